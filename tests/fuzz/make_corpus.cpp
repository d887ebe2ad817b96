// Writes the corpus: for each target some files of a few hundred bytes, of each kind that the
// reader takes. fuzz_make_corpus FOLDER
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <tiffio.h>
#include <vtkImageData.h>
#include <vtkJPEGWriter.h>
#include <vtkNew.h>
#include <vtkXMLImageDataWriter.h>
#include <zlib.h>

#include <cstdio>

#include "libcurve/image/write_image.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/volume/write_volume.h"
#include "tests/surf/volume/dicom_files.h"

namespace surf::fuzz {
namespace {

namespace fs = std::filesystem;
using volume::Grid;
using volume::nifti_bytes;
using volume::turn_header;

const Grid kGrid = {
    "box", {4, 3, 5}, volume::affine(Eigen::Vector3d(1, 2, 3).asDiagonal(), {0, 0, 0})};

class Corpus {
 public:
  explicit Corpus(fs::path folder) : folder_(std::move(folder)) {}

  std::string path(const std::string& target, const std::string& name) const {
    fs::create_directories(folder_ / target);
    return (folder_ / target / name).string();
  }
  void text(const std::string& target, const std::string& name, const std::string& bytes) const {
    std::ofstream(path(target, name), std::ios::binary) << bytes;
  }

  void nifti() const {
    const std::string data = volume::raw_bytes(volume::values<std::int16_t>(kGrid.size));
    auto first = volume::nifti_header<nifti_1_header>(kGrid);
    text("nifti", "first.nii", nifti_bytes(first, data));
    text("nifti", "second.nii", nifti_bytes(volume::nifti_header<nifti_2_header>(kGrid), data));
    first.dim[0] = 4;
    first.dim[4] = 2;
    first.scl_slope = 0.5;
    first.sform_code = 0;
    first.qform_code = 1;
    text("nifti", "frames-qform.nii", nifti_bytes(first, data + data));
    auto turned = volume::nifti_header<nifti_1_header>(kGrid);
    turn_header(turned);
    text("nifti", "big-endian.nii",
         nifti_bytes(turned, volume::raw_bytes(volume::values<std::int16_t>(kGrid.size), true)));
    volume::write_volume(path("nifti", "floats.nii.gz"), volume_of(kGrid));
  }

  void metaimage() const {
    const std::string header =
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 1 1 1\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nDimSize = 4 3 5\n"
        "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    text("metaimage", "bytes.mha",
         header + volume::raw_bytes(volume::values<std::uint8_t>(kGrid.size)));
    volume::write_volume(path("metaimage", "floats.mha"), volume_of(kGrid));
  }

  void nrrd() const {
    const auto header = [](const std::string& encoding) {
      return "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 5\n"
             "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\n"
             "encoding: " +
             encoding + "\nspace origin: (0,0,0)\n\n";
    };
    std::string words;
    for (const int value : volume::values<int>(kGrid.size)) words += fmt::format("{} ", value);
    text("nrrd", "raw.nrrd",
         header("raw") + volume::raw_bytes(volume::values<std::uint8_t>(kGrid.size)));
    text("nrrd", "text.nrrd", header("text") + words + "\n");
    volume::write_volume(path("nrrd", "floats.nrrd"), volume_of(kGrid));
  }

  void dicom() const {
    Grid pair = kGrid;
    pair.size = {8, 6, 2};
    volume::write_slice((folder_.parent_path() / "next-slice.dcm").string(), slice_of(pair, 1));
    const std::pair<const char*, gdcm::TransferSyntax::TSType> syntaxes[] = {
        {"plain.dcm", gdcm::TransferSyntax::ExplicitVRLittleEndian},
        {"implicit.dcm", gdcm::TransferSyntax::ImplicitVRLittleEndian},
        {"rle.dcm", gdcm::TransferSyntax::RLELossless},
        {"jpeg-lossless.dcm", gdcm::TransferSyntax::JPEGLosslessProcess14_1},
        {"jpeg-ls.dcm", gdcm::TransferSyntax::JPEGLSLossless},
        {"jpeg-2000.dcm", gdcm::TransferSyntax::JPEG2000Lossless}};
    for (const auto& [name, syntax] : syntaxes) {
      const std::string file = path("dicom", name);
      volume::write_slice(file, slice_of(pair, 0));
      if (syntax != gdcm::TransferSyntax::ExplicitVRLittleEndian) volume::compress(file, syntax);
    }
    volume::DicomImage frames = slice_of(pair, 0);
    const auto second = slice_of(pair, 1);
    frames.positions_lps.push_back(second.positions_lps[0]);
    frames.pixels.insert(frames.pixels.end(), second.pixels.begin(), second.pixels.end());
    volume::write_enhanced(path("dicom", "frames.dcm"), frames, true);
    volume::write_enhanced(path("dicom", "implicit-frames.dcm"), frames, true,
                           volume::Syntax::kImplicit);
  }

  void vti() const {
    vtkNew<vtkImageData> image;
    image->SetDimensions(4, 3, 5);
    image->AllocateScalars(VTK_SHORT, 1);
    auto* scalars = static_cast<short*>(image->GetScalarPointer());
    for (const int value : volume::values<int>(kGrid.size)) *scalars++ = short(value);
    vtkNew<vtkXMLImageDataWriter> writer;
    writer->SetInputData(image);
    const auto save = [&](const char* name) {
      writer->SetFileName(path("vti", name).c_str());
      writer->Write();
    };
    save("appended.vti");
    writer->SetDataModeToBinary();
    save("binary.vti");
    writer->SetCompressorTypeToNone();
    writer->SetHeaderTypeToUInt32();
    save("uncompressed.vti");
    writer->SetDataModeToAscii();
    save("ascii.vti");
    writer->SetDataModeToAppended();
    writer->EncodeAppendedDataOff();
    save("raw.vti");
  }

  template <class Grid>
  void vdb(const char* name, std::uint32_t compression) const {
    auto grid = Grid::create();
    for (int k = 0; k < 5; ++k)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 4; ++i)
          grid->tree().setValue({i, j, k}, typename Grid::ValueType(volume::value_at(i, j, k)));
    openvdb::io::File file(path("vdb", name));
    file.setCompression(compression);
    file.write(openvdb::GridCPtrVec{grid});
  }

  /// A level set of halves with tiles and inactive voxels, and a grid behind one that is no
  /// scalar's.
  void more_vdb() const {
    const auto level_set = openvdb::FloatGrid::create(3);
    level_set->setGridClass(openvdb::GRID_LEVEL_SET);
    level_set->setSaveFloatAsHalf(true);
    level_set->tree().addTile(1, {8, 0, 0}, 2, true);
    level_set->tree().addTile(1, {8, 8, 0}, -3, false);
    for (int n = 0; n < 60; ++n) level_set->tree().setValue({n % 5, n % 4, n % 3}, float(n) / 8);
    for (int n = 0; n < 60; ++n) level_set->tree().setValueOff({n % 7, 5, n % 3}, n % 2 ? -3 : 7);
    openvdb::io::File halves(path("vdb", "halves.vdb"));
    halves.setCompression(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
    halves.write(openvdb::GridCPtrVec{level_set});

    const auto scaled = openvdb::Int64Grid::create();
    scaled->setTransform(openvdb::math::Transform::createLinearTransform(2));
    for (int n = 0; n < 27; ++n) scaled->tree().setValue({n % 3, n / 3 % 3, n / 9}, n);
    openvdb::io::File second(path("vdb", "second.vdb"));
    second.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    second.write(openvdb::GridCPtrVec{openvdb::Vec3SGrid::create(), scaled});
  }

  void surfaces() const {
    Triangles surface;
    surface.points.resize(4, 3);
    surface.points << 0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10;
    surface.elements.resize(4, 3);
    surface.elements << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
    const io::WriteOptions options{
        .arrays = {{"deviation_mm", Eigen::VectorXd::LinSpaced(4, 0, 1)}}};
    for (const std::string name : {"stl", "obj", "ply", "vtp"})
      io::write_surface(path(name, "written." + name), surface,
                        name == "ply" || name == "vtp" ? options : io::WriteOptions{});
    text("stl", "text.stl",
         "solid a SPACE=RAS\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
         "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
    text("obj", "polygons.obj",
         "# SPACE=RAS\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1e0 0 1\nvn 0 0 1\nvt 0 0\ng x\n"
         "f 1/1/1 2//1 3 4\nf -4 -3 -2\n");
    for (const auto& [name, faces] :
         {std::pair{"text.ply", "property list uchar int vertex_indices\n"},
          {"text-lists.ply", "property list uint8 uint32 vertex_index\nproperty float quality\n"}})
      text("ply", name,
           fmt::format(
               "ply\nformat ascii 1.0\ncomment SPACE=RAS\nelement vertex 3\n"
               "property float x\nproperty float y\nproperty float z\nelement face 1\n{}"
               "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2{}\n",
               faces,
               faces == std::string_view("property list uchar int vertex_indices\n") ? "" : " 1"));
    text("vtp", "text.vtp",
         "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
         "byte_order=\"LittleEndian\"><PolyData><Piece NumberOfPoints=\"3\" NumberOfVerts=\"0\" "
         "NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"1\"><Points><DataArray "
         "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray>"
         "</Points><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2"
         "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray>"
         "</Polys></Piece></PolyData></VTKFile>\n");
  }

  void images() const {
    std::vector<float> values;
    std::vector<std::uint8_t> labels;
    for (int at = 0; at < 12 * 9; ++at) {
      values.push_back(float(at % 7) * 0.5f);
      labels.push_back(std::uint8_t(at % 5));
    }
    const curve::Image image({12, 9}, curve::pixel_to_plane({0.5, 0.5}), values);
    curve::write_image(path("png", "sixteen-bits.png"), image);
    curve::write_labels(path("png", "eight-bits.png"), {12, 9}, labels);
    curve::write_image(path("tiff", "floats.tif"), image);
    for (const auto& [name, compression] : {std::pair{"plain.tif", COMPRESSION_NONE},
                                            {"lzw.tif", COMPRESSION_LZW},
                                            {"deflate.tif", COMPRESSION_ADOBE_DEFLATE},
                                            {"packed.tif", COMPRESSION_PACKBITS}}) {
      TIFF* tiff = TIFFOpen(path("tiff", name).c_str(), "w");
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 12);
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 9);
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
      TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
      TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 4);
      for (int row = 0; row < 9; ++row) TIFFWriteScanline(tiff, &labels[row * 12], row, 0);
      TIFFClose(tiff);
    }
    vtkNew<vtkImageData> grey;
    grey->SetDimensions(12, 9, 1);
    for (const int n_components : {1, 3}) {
      grey->AllocateScalars(VTK_UNSIGNED_CHAR, n_components);
      auto* bytes = static_cast<unsigned char*>(grey->GetScalarPointer());
      for (int at = 0; at < 12 * 9 * n_components; ++at) bytes[at] = std::uint8_t(17 * at);
      for (const bool is_progressive : {false, true}) {
        vtkNew<vtkJPEGWriter> writer;
        writer->SetInputData(grey);
        writer->SetProgressive(is_progressive);
        writer->SetFileName(
            path("jpeg", fmt::format("{}-{}.jpg", n_components == 1 ? "grey" : "colour",
                                     is_progressive ? "progressive" : "baseline"))
                .c_str());
        writer->Write();
      }
    }
  }

  void contours() const {
    text("geojson", "polygons.json",
         "{\"type\":\"FeatureCollection\",\"unit\":\"mm\",\"features\":[{\"type\":\"Feature\","
         "\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[[[0,0],[4,0],[4,4],[0,4],[0,0]],"
         "[[1,1],[1,2],[2,2],[1,1]]]}},{\"type\":\"Feature\",\"geometry\":{\"type\":"
         "\"MultiPolygon\",\"coordinates\":[[[[9,9],[8,9],[9,8.5e0],[9,9]]]]}}]}\n");
    text("contours-csv", "rings.csv",
         "polygon,ring,x_mm,y_mm\n0,0,0,0\n0,0,4,0\n0,0,4,4\n0,1,1,1\n0,1,1,2\n0,1,2,2\n"
         "1,0,9,9\n1,0,8,9\n1,0,9,8.5\n");
  }

  void landmarks() const {
    text("landmarks-fcsv", "slicer.fcsv",
         "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
         "# columns = id,x,y,z,ow\n1,1.5,-2,3e1,0\n2,4,5,6,0\n");
    text("landmarks-json", "slicer.mrk.json",
         "{\"markups\":[{\"type\":\"Fiducial\",\"coordinateSystem\":\"LPS\",\"coordinateUnits\":"
         "\"mm\",\"controlPoints\":[{\"id\":\"1\",\"position\":[1,2.5,-3],\"positionStatus\":"
         "\"defined\"},{\"position\":[4,5,6]}]}]}\n");
    text("landmarks-text", "points.txt", "# SPACE=RAS\n1 2.5 -3\n4,5,6\n7; 8; 9e0\n");
    text("landmarks-text", "plane.txt", "1 2\n4,5\n\n7\t8\n");
  }

  void documents() const {
    text("recipe", "volume.json",
         "{\"kind\":\"surfseg recipe\",\"version\":2,\"dimension\":3,\"image\":{\"path\":\"a.nii\","
         "\"size\":[4,3,5],\"content\":\"0123\"},\"objects\":[{\"name\":\"liver\",\"colour\":"
         "[230,159,0],\"history\":[{\"do\":\"options\",\"options\":{\"sigma_mm\":1.5}},{\"do\":"
         "\"click\",\"side\":\"inside\",\"point_mm\":[1,2,3]},{\"do\":\"click\",\"side\":"
         "\"outside\",\"point_mm\":[4,5,6],\"stroke_mm\":[[4,5,6],[4,5,7]]},{\"do\":\"propose\","
         "\"others\":[{\"point_mm\":[0,0,0]}]},{\"do\":\"choose\",\"proposal\":0},{\"do\":"
         "\"evolve\",\"stopped_at\":3},{\"do\":\"take back click\",\"index\":1},{\"do\":\"rename\","
         "\"name\":\"b\"},{\"do\":\"recolour\",\"colour\":[1,2,3]}]}]}\n");
    text("recipe", "image.json",
         "{\"kind\":\"surfseg recipe\",\"version\":1,\"dimension\":2,\"image\":{},\"objects\":[{"
         "\"name\":\"a\",\"colour\":[0,0,0],\"history\":[{\"do\":\"click\",\"side\":\"inside\","
         "\"point_mm\":[1,2]},{\"do\":\"evolve\"}]}]}\n");
    text("config", "options.json",
         "{\"description\":\"a preset\",\"seed\":[\"1,2,3\",\"4,5,6\"],\"flow\":\"l2\",\"gamma\":"
         "0.5,\"levels\":2,\"quiet\":true,\"output\":null}\n");
    text("config", "summary.json", "{\"config\":{\"seed\":\"1,2,3\",\"gamma\":1e-3}}\n");
  }

 private:
  fs::path folder_;
};

void make(const fs::path& folder) {
  openvdb::initialize();
  const Corpus corpus(folder);
  corpus.nifti();
  corpus.metaimage();
  corpus.nrrd();
  corpus.dicom();
  corpus.vti();
  corpus.vdb<openvdb::FloatGrid>("mask.vdb", openvdb::io::COMPRESS_ACTIVE_MASK);
  corpus.vdb<openvdb::DoubleGrid>("zip.vdb",
                                  openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
  corpus.vdb<openvdb::Int32Grid>("blosc.vdb",
                                 openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  corpus.more_vdb();
  corpus.surfaces();
  corpus.images();
  corpus.contours();
  corpus.landmarks();
  corpus.documents();
}

}  // namespace
}  // namespace surf::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  surf::fuzz::make(argv[1]);
  return 0;
}
