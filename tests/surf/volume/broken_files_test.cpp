// One clear line for each way a volume's file can be broken.
#include <fmt/format.h>
#include <zlib.h>

#include <functional>
#include <limits>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

const Grid kGrid = {"box", {4, 3, 5}, affine(Eigen::Vector3d(1, 2, 3).asDiagonal(), {0, 0, 0})};

template <class Header, class Spoil>
std::string any_nifti(const Spoil& spoil, std::string data) {
  Header header = nifti_header<Header>(kGrid);
  spoil(header);
  if (data.empty()) data = raw_bytes(values<std::int16_t>(kGrid.size));
  return nifti_bytes(header, data);
}

std::string nifti(const std::function<void(nifti_1_header&)>& spoil, const std::string& data = {}) {
  return any_nifti<nifti_1_header>(spoil, data);
}

std::string nifti2(const std::function<void(nifti_2_header&)>& spoil) {
  return any_nifti<nifti_2_header>(spoil, {});
}

std::string intact_nifti() {
  return nifti([](auto&) {});
}

std::string floats_with(float value) {
  auto data = values<float>(kGrid.size);
  data[17] = value;
  return nifti([](auto& header) { header.datatype = NIFTI_TYPE_FLOAT32; }, raw_bytes(data));
}

std::string gzipped(const std::string& bytes) {
  z_stream stream = {};
  deflateInit2(&stream, 6, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY);
  std::string result(bytes.size() + 1024, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<unsigned>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<unsigned>(result.size());
  deflate(&stream, Z_FINISH);
  const std::size_t n_bytes = stream.total_out;
  deflateEnd(&stream);
  return result.substr(0, n_bytes);
}

std::string spoiled_at(std::string bytes, std::size_t place) {
  bytes[place] = static_cast<char>(bytes[place] ^ 0x5a);
  return bytes;
}

constexpr const char* kMetaImage =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 1 1\n"
    "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nDimSize = 4 3 5\n"
    "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
constexpr const char* kNrrd =
    "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 5\n"
    "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nencoding: raw\n"
    "space origin: (0,0,0)\n\n";

/// A header with one place replaced, and data.
std::string with_data(std::string header, const std::string& from = "",
                      const std::string& to = "") {
  if (!from.empty()) header.replace(header.find(from), from.size(), to);
  return header + raw_bytes(values<std::uint8_t>(kGrid.size));
}

std::string vti(const std::string& from = "", const std::string& to = "") {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"0 3 0 2 0 4\" Origin=\"0 0 0\" "
      "Spacing=\"1 1 1\">\n<Piece Extent=\"0 3 0 2 0 4\">\n<PointData Scalars=\"v\">\n"
      "<DataArray type=\"Int16\" Name=\"v\" format=\"ascii\">\n";
  for (const int value : values<int>(kGrid.size)) text += std::to_string(value) + " ";
  text +=
      "\n</DataArray>\n</PointData>\n<CellData></CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n";
  for (std::size_t at = 0; !from.empty() && (at = text.find(from, at)) != std::string::npos;
       at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

struct BrokenFile {
  const char* test;
  const char* file;
  std::string bytes;
  const char* piece;  ///< of the message
};

void PrintTo(const BrokenFile& broken, std::ostream* stream) { *stream << broken.test; }

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInf = std::numeric_limits<float>::infinity();

const std::vector<BrokenFile> kBroken = {
    // Not a volume at all.
    {"Empty", "a.nii", "", "is empty"},
    {"EmptyGzip", "a.nii.gz", gzipped(""), "is empty"},
    {"Text", "a.txt", "hello, world", "not a volume; surfseg reads NIfTI"},
    {"Png", "a.png", "\x89PNG\r\n\x1a\n0123456789", "not a volume"},
    {"TextAsNifti", "a.nii", std::string(400, 'x'), "not a NIfTI file"},
    {"TextAsNrrd", "a.nrrd", std::string(400, 'x'), "not a readable NRRD"},
    {"TextAsMetaImage", "a.mha", "hello\nworld\n", "not a MetaImage header"},
    {"TextAsDicom", "a.dcm", std::string(400, 'x'), "not a DICOM image"},
    {"TextAsVti", "a.vti", "hello", "not VTK image data"},
    {"TextAsVdb", "a.vdb", std::string(400, 'x'), "not a readable OpenVDB file"},
    {"DicomMagicOnly", "a.dcm", std::string(128, '\0') + "DICM", "not a DICOM image"},
    // NIfTI: truncated, damaged.
    {"NiftiCutInHeader", "a.nii", intact_nifti().substr(0, 200), "truncated: the data end after"},
    {"NiftiCutInVoxels", "a.nii", intact_nifti().substr(0, 400),
     "truncated: the header promises 120 bytes of voxels, the file holds 48"},
    {"NiftiGzipCut", "a.nii.gz", gzipped(intact_nifti()).substr(0, 150), "truncated"},
    {"NiftiGzipWithoutEnd", "a.nii.gz",
     gzipped(intact_nifti()).substr(0, gzipped(intact_nifti()).size() - 6), "truncated"},
    {"NiftiGzipDamaged", "a.nii.gz", spoiled_at(gzipped(intact_nifti()), 120), "damaged"},
    {"NiftiGzipWrongSum", "a.nii.gz",
     spoiled_at(gzipped(intact_nifti()), gzipped(intact_nifti()).size() - 7), "damaged"},
    // NIfTI: the header.
    {"NiftiMagic", "a.nii", nifti([](auto& h) { h.magic[1] = '7'; }), "the magic is neither"},
    {"Nifti2Magic", "a.nii", nifti2([](auto& h) { h.magic[0] = 'x'; }), "the magic is neither"},
    {"NiftiNoDimensions", "a.nii", nifti([](auto& h) { h.dim[0] = 0; }), "dim[0] = 0"},
    {"NiftiManyDimensions", "a.nii", nifti([](auto& h) { h.dim[0] = 99; }), "dim[0] = 99"},
    {"NiftiNegativeSize", "a.nii", nifti([](auto& h) { h.dim[2] = -3; }),
     "the header gives 4 x -3 x 5 voxels"},
    {"NiftiPlane", "a.nii", nifti([](auto& h) { h.dim[3] = 1; }), "at least 2 along every axis"},
    {"NiftiTwoDimensions", "a.nii", nifti([](auto& h) { h.dim[0] = 2; }),
     "at least 2 along every axis"},
    {"NiftiNegativeFrames", "a.nii", nifti([](auto& h) {
       h.dim[0] = 4;
       h.dim[4] = -1;
     }),
     "dim[4] = -1 frames"},
    {"NiftiBeyondFile", "a.nii", nifti([](auto& h) { h.dim[1] = h.dim[2] = 1000; }),
     "truncated: the header promises 10000000 bytes"},
    {"NiftiBeyondGzip", "a.nii.gz", gzipped(nifti([](auto& h) { h.dim[1] = h.dim[2] = 1000; })),
     "truncated: the header promises 10000000 bytes"},
    {"NiftiBeyondMemory", "a.nii", nifti([](auto& h) { h.dim[1] = h.dim[2] = h.dim[3] = 32767; }),
     "this machine has"},
    {"Nifti2BeyondInt", "a.nii", nifti2([](auto& h) { h.dim[1] = std::int64_t(1) << 40; }),
     "each must be from 2 to 2147483647"},
    {"Nifti2BeyondEverything", "a.nii",
     nifti2([](auto& h) { h.dim[1] = h.dim[2] = h.dim[3] = 2147483647; }), "it is broken"},
    {"NiftiComplex", "a.nii", nifti([](auto& h) { h.datatype = NIFTI_TYPE_COMPLEX64; }),
     "datatype 32 (complex)"},
    {"NiftiColour", "a.nii", nifti([](auto& h) { h.datatype = NIFTI_TYPE_RGB24; }),
     "datatype 128 (colour)"},
    {"NiftiUnknownType", "a.nii", nifti([](auto& h) { h.datatype = 999; }),
     "datatype 999 (unknown)"},
    {"NiftiOffsetNan", "a.nii", nifti([](auto& h) { h.vox_offset = kNan; }), "vox_offset = nan"},
    {"NiftiOffsetBeyondFile", "a.nii", nifti([](auto& h) { h.vox_offset = 1e6; }), "truncated"},
    {"NiftiSingular", "a.nii",
     nifti([](auto& h) { std::memcpy(h.srow_z, h.srow_y, sizeof h.srow_z); }), "spacing"},
    {"NiftiFlat", "a.nii", nifti([](auto& h) {
       std::memcpy(h.srow_z, h.srow_y, sizeof h.srow_z);
       h.srow_y[2] = h.srow_z[2] = 1;
     }),
     "matrix is singular"},
    {"NiftiMatrixNan", "a.nii", nifti([](auto& h) { h.srow_x[3] = kNan; }),
     "matrix has a NaN or Inf"},
    {"NiftiMatrixInf", "a.nii", nifti([](auto& h) { h.srow_x[0] = kInf; }),
     "matrix has a NaN or Inf"},
    {"NiftiZeroSpacing", "a.nii", nifti([](auto& h) {
       h.sform_code = 0;
       h.pixdim[3] = 0;
     }),
     "zero voxel spacing"},
    {"NiftiTinySpacing", "a.nii",
     nifti([](auto& h) { h.srow_x[0] = h.srow_y[1] = h.srow_z[2] = 1e-7f; }), "too small"},
    {"NiftiZeroSform", "a.nii", nifti([](auto& h) { h.srow_x[0] = h.srow_y[1] = h.srow_z[2] = 0; }),
     "zero voxel spacing"},
    {"NiftiVoxelNan", "a.nii", floats_with(kNan), "voxel (1, 1, 1) is NaN"},
    {"NiftiVoxelInf", "a.nii", floats_with(-kInf), "voxel (1, 1, 1) is Inf"},
    {"NiftiVoxelHuge", "a.nii", floats_with(3e38f), "voxel (1, 1, 1) is beyond 1e18"},
    {"NiftiOtherHalf", "a.hdr", nifti([](auto& h) { std::memcpy(h.magic, "ni1", 4); }),
     "a.img is missing"},
    // MetaImage.
    {"MetaCut", "a.mha", with_data(kMetaImage).substr(0, with_data(kMetaImage).size() - 10),
     "truncated: the header promises 60 bytes"},
    {"MetaCutHeader", "a.mha", with_data(kMetaImage).substr(0, 90),
     "without its line ElementDataFile"},
    {"MetaPlane", "a.mha", with_data(kMetaImage, "NDims = 3", "NDims = 2"), "has 2 dimensions"},
    {"MetaManyDimensions", "a.mha", with_data(kMetaImage, "NDims = 3", "NDims = 64"),
     "has 64 dimensions"},
    {"MetaNoSize", "a.mha", with_data(kMetaImage, "DimSize = 4 3 5", "DimSize = 4 x"),
     "DimSize needs 3 numbers"},
    {"MetaHugeSize", "a.mha", with_data(kMetaImage, "4 3 5", "1e300 3 5"), "not a whole number"},
    {"MetaZeroSize", "a.mha", with_data(kMetaImage, "4 3 5", "0 3 5"),
     "the header gives 0 x 3 x 5"},
    {"MetaType", "a.mha", with_data(kMetaImage, "MET_UCHAR", "MET_OTHER"),
     "ElementType 'MET_OTHER'"},
    {"MetaChannels", "a.mha",
     with_data(kMetaImage, "Offset =", "ElementNumberOfChannels = 3\nOffset ="),
     "has 3 values per voxel"},
    {"MetaZeroSpacing", "a.mha", with_data(kMetaImage, "Spacing = 1 1 1", "Spacing = 1 0 1"),
     "zero voxel spacing"},
    {"MetaSingular", "a.mha", with_data(kMetaImage, "1 0 0 0 1 0 0 0 1", "1 0 0 1 0 0 0 0 1"),
     "matrix is singular"},
    {"MetaNan", "a.mha", with_data(kMetaImage, "Offset = 0", "Offset = nan"), "NaN or Inf"},
    {"MetaNoRawFile", "a.mhd", with_data(kMetaImage, "LOCAL", "gone.raw"), "'gone.raw' is missing"},
    {"MetaNotCompressed", "a.mha",
     with_data(kMetaImage, "Offset =", "CompressedData = True\nOffset ="),
     "damaged compressed data"},
    // NRRD.
    {"NrrdCut", "a.nrrd", with_data(kNrrd).substr(0, with_data(kNrrd).size() - 10), "truncated"},
    {"NrrdCutHeader", "a.nrrd", with_data(kNrrd).substr(0, 60), "not a readable NRRD"},
    {"NrrdPlane", "a.nrrd",
     "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 3 3\nencoding: raw\n\n123456789",
     "has 2 dimensions"},
    {"NrrdVectors", "a.nrrd",
     "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 2 2 2\nkinds: vector domain domain domain\n"
     "encoding: raw\n\n123456789012345678901234",
     "several values per voxel (kind 'vector')"},
    {"NrrdType", "a.nrrd", with_data(kNrrd, "uchar", "other"), "not a readable NRRD"},
    {"NrrdZeroSize", "a.nrrd", with_data(kNrrd, "4 3 5", "4 0 5"), "not a readable NRRD"},
    {"NrrdSingular", "a.nrrd", with_data(kNrrd, "(0,1,0)", "(1,0,0)"), "matrix is singular"},
    {"NrrdUnit", "a.nrrd",
     with_data(kNrrd, "encoding", "space units: \"ell\" \"ell\" \"ell\"\nencoding"),
     "space unit 'ell'"},
    {"NrrdNoRawFile", "a.nhdr", with_data(kNrrd, "encoding", "data file: gone.raw\nencoding"),
     "gone.raw"},
    {"NrrdNotGzip", "a.nrrd", with_data(kNrrd, "encoding: raw", "encoding: gzip"),
     "damaged compressed data"},
    // VTI.
    {"VtiCut", "a.vti", vti().substr(0, vti().size() / 2), "truncated"},
    {"VtiOtherType", "a.vti", vti("ImageData", "PolyData"), "not VTK image data"},
    {"VtiPlane", "a.vti", vti("0 4\"", "0 0\""), "at least 2 along every axis"},
    {"VtiHuge", "a.vti", vti("0 3 0 2 0 4", "0 2000 0 2000 0 2000"), "truncated"},
    {"VtiZeroSpacing", "a.vti", vti("Spacing=\"1 1 1\"", "Spacing=\"1 0 1\""),
     "zero voxel spacing"},
    {"VtiNotXml", "a.vti", vti("</PointData>", "</Point"), "not readable VTK image data"},
    {"VtiFewValues", "a.vti", vti("57 ", ""), "cannot be read"},
    // OpenVDB.
    {"VdbMagicOnly", "a.vdb", std::string(" BDV\0\0\0\0", 8), "a.vdb: "},
    {"VdbRubbish", "a.vdb", std::string(" BDV\0\0\0\0", 8) + std::string(500, '\x7f'), "a.vdb: "},
};

class Broken : public Files, public ::testing::WithParamInterface<BrokenFile> {};

TEST_P(Broken, FileIsOneLineThatNamesItAndTheFault) {
  const std::string file = write(GetParam().file, GetParam().bytes);
  const std::string message = failure(file);
  EXPECT_TRUE(message.starts_with(file)) << message;
  EXPECT_NE(message.find(GetParam().piece), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(All, Broken, ::testing::ValuesIn(kBroken),
                         [](const auto& test) { return test.param.test; });

class BrokenPlaces : public Files {};

TEST_F(BrokenPlaces, MissingFilesAndFoldersAreNamed) {
  EXPECT_NE(failure(path("gone.nii")).find("gone.nii: cannot be read: No such file"),
            std::string::npos);
  std::filesystem::create_directories(path("folder"));
  EXPECT_NE(failure(path("folder")).find("no DICOM image among them"), std::string::npos);
}

TEST_F(BrokenPlaces, TemplatesOfTheTableAreIntact) {
  EXPECT_EQ(failure(write("a.nii", intact_nifti())), "");
  EXPECT_EQ(failure(write("b.nii", nifti2([](auto&) {}))), "");
  EXPECT_EQ(failure(write("c.nii.gz", gzipped(intact_nifti()))), "");
  EXPECT_EQ(failure(write("a.mha", with_data(kMetaImage))), "");
  EXPECT_EQ(failure(write("a.nrrd", with_data(kNrrd))), "");
  EXPECT_EQ(failure(write("a.vti", vti())), "");
}

/// Every byte of a header, turned in turn: each file is read or refused in one line.
TEST_F(BrokenPlaces, AnySpoiledByteIsReadOrRefusedInOneLine) {
  const std::pair<const char*, std::string> files[] = {
      {"a.nii", intact_nifti()}, {"a.mha", with_data(kMetaImage)}, {"a.nrrd", with_data(kNrrd)}};
  for (const auto& [name, bytes] : files)
    for (std::size_t place = 0; place < bytes.size(); ++place) {
      const std::string message = failure(write(name, spoiled_at(bytes, place)));
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_LT(message.size(), 400u) << message;
    }
}

}  // namespace
}  // namespace surf::volume
