#include "libsurf/volume/detail/read_nifti.h"

#include <zlib.h>

#include <limits>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

template <class Header>
class ReadNifti : public Files {};
using Versions = ::testing::Types<nifti_1_header, nifti_2_header>;
TYPED_TEST_SUITE(ReadNifti, Versions);

TYPED_TEST(ReadNifti, SformIsTheAffineWhateverItIs) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    const auto header = nifti_header<TypeParam>(grid);
    const Volume volume = read_volume(
        this->write("a.nii", nifti_bytes(header, raw_bytes(values<std::int16_t>(grid.size)))));
    expect_volume(volume, grid);
    EXPECT_EQ(volume.source().scalar_type, "int16");
    EXPECT_EQ(volume.source().orientation_source, "sform");
  }
}

TYPED_TEST(ReadNifti, OtherByteOrderIsTurned) {
  const Grid grid = grids()[0];
  auto header = nifti_header<TypeParam>(grid);
  header.scl_slope = 2;
  header.scl_inter = -30;
  turn_header(header);
  expect_volume(
      read_volume(this->write(
          "a.nii", nifti_bytes(header, raw_bytes(values<std::int16_t>(grid.size), true)))),
      grid, 2, -30);
}

TYPED_TEST(ReadNifti, EveryScalarTypeIsRead) {
  const Grid grid = grids()[1];
  const auto check = [&](int datatype, auto scalar, const char* name) {
    SCOPED_TRACE(name);
    auto header = nifti_header<TypeParam>(grid);
    header.datatype = static_cast<std::int16_t>(datatype);
    const auto data = values<decltype(scalar)>(grid.size);
    const Volume volume = read_volume(this->write("a.nii", nifti_bytes(header, raw_bytes(data))));
    EXPECT_EQ(volume.source().scalar_type, name);
    expect_volume(volume, grid);
  };
  check(NIFTI_TYPE_INT8, std::int8_t(), "int8");
  check(NIFTI_TYPE_UINT8, std::uint8_t(), "uint8");
  check(NIFTI_TYPE_INT16, std::int16_t(), "int16");
  check(NIFTI_TYPE_UINT16, std::uint16_t(), "uint16");
  check(NIFTI_TYPE_INT32, std::int32_t(), "int32");
  check(NIFTI_TYPE_UINT32, std::uint32_t(), "uint32");
  check(NIFTI_TYPE_INT64, std::int64_t(), "int64");
  check(NIFTI_TYPE_UINT64, std::uint64_t(), "uint64");
  check(NIFTI_TYPE_FLOAT32, float(), "float32");
  check(NIFTI_TYPE_FLOAT64, double(), "float64");
}

TYPED_TEST(ReadNifti, FrameIsChosenAndThereIsNoOther) {
  const Grid grid = grids()[2];
  auto header = nifti_header<TypeParam>(grid);
  header.dim[0] = 4;
  header.dim[4] = 3;
  std::string data;
  for (int frame = 0; frame < 3; ++frame)
    data += raw_bytes(values<std::int16_t>(grid.size, 1000 * frame));
  const std::string file = this->write("a.nii", nifti_bytes(header, data));
  for (int frame = 0; frame < 3; ++frame) {
    const Volume volume = read_volume(file, {.frame_index = frame, .series_uid = {}});
    EXPECT_EQ(volume.source().n_frames, 3);
    EXPECT_EQ(volume.source().frame, frame);
    expect_volume(volume, grid, 1, 1000 * frame);
  }
  for (const int frame : {3, -1})
    EXPECT_NE(failure(file, {.frame_index = frame, .series_uid = {}}).find("has 3 frames"),
              std::string::npos);
}

TYPED_TEST(ReadNifti, SlopeOfZeroOrNanIsNone) {
  const Grid grid = grids()[0];
  for (const float slope : {0.0f, std::numeric_limits<float>::quiet_NaN()}) {
    auto header = nifti_header<TypeParam>(grid);
    header.scl_slope = slope;
    header.scl_inter = 5;
    expect_volume(read_volume(this->write(
                      "a.nii", nifti_bytes(header, raw_bytes(values<std::int16_t>(grid.size))))),
                  grid);
  }
}

TYPED_TEST(ReadNifti, LengthsInMetresBecomeMillimetres) {
  const Grid grid = grids()[0];
  Grid in_meters = grid;
  in_meters.index_to_world.matrix().topRows<3>() *= 1e-3;
  auto header = nifti_header<TypeParam>(in_meters);
  header.xyzt_units = NIFTI_UNITS_METER;
  const Volume volume = read_volume(
      this->write("a.nii", nifti_bytes(header, raw_bytes(values<std::int16_t>(grid.size)))));
  expect_volume(volume, grid);
  EXPECT_EQ(volume.source().notes.size(), 1u);
}

class ReadNiftiFiles : public Files {};

TEST_F(ReadNiftiFiles, GzipOfSeveralMembersIsOneFile) {
  const Grid grid = grids()[0];
  const std::string bytes =
      nifti_bytes(nifti_header<nifti_1_header>(grid), raw_bytes(values<std::int16_t>(grid.size)));
  for (const char* mode : {"wb", "ab"}) {  // a second member is appended
    gzFile file = gzopen(path("a.nii.gz").c_str(), mode);
    const std::size_t half = bytes.size() / 2;
    const std::size_t begin = mode[0] == 'w' ? 0 : half;
    const auto n = static_cast<unsigned>(mode[0] == 'w' ? half : bytes.size() - half);
    ASSERT_EQ(gzwrite(file, bytes.data() + begin, n), static_cast<int>(n));
    gzclose(file);
  }
  expect_volume(read_volume(path("a.nii.gz")), grid);
}

TEST_F(ReadNiftiFiles, ContentCountsNotTheName) {
  const Grid grid = grids()[0];
  write("scan.dat", nifti_bytes(nifti_header<nifti_1_header>(grid),
                                raw_bytes(values<std::int16_t>(grid.size))));
  expect_volume(read_volume(path("scan.dat")), grid);
}

TEST_F(ReadNiftiFiles, PairIsReadFromEitherHalf) {
  const Grid grid = grids()[1];
  auto header = nifti_header<nifti_1_header>(grid);
  std::memcpy(header.magic, "ni1", 4);
  header.vox_offset = 0;
  write("a.hdr", std::string(reinterpret_cast<const char*>(&header), sizeof header));
  write("a.img", raw_bytes(values<std::int16_t>(grid.size)));
  expect_volume(read_volume(path("a.hdr")), grid);
  expect_volume(read_volume(path("a.img")), grid);
  const std::vector<std::string> both = {path("a.hdr"), path("a.img")};
  EXPECT_EQ(volume_files(path("a.hdr")), both);
  EXPECT_EQ(volume_files(path("a.img")), both);
  std::filesystem::rename(path("a.img"), path("a.img.gz"));  // gzip or not, by its content
  const std::vector<std::string> packed = {path("a.hdr"), path("a.img.gz")};
  EXPECT_EQ(volume_files(path("a.hdr")), packed);
  EXPECT_EQ(volume_files(path("a.img.gz")), packed);
}

TEST_F(ReadNiftiFiles, AnalyzeIsReadWithANoteOnItsOrientation) {
  Grid grid = grids()[1];
  auto header = nifti_header<nifti_1_header>(grid);
  std::memset(header.magic, 0, 4);
  header.vox_offset = 0;
  write("a.hdr", std::string(reinterpret_cast<const char*>(&header), sizeof header));
  write("a.img", raw_bytes(values<std::int16_t>(grid.size)));
  const Volume volume = read_volume(path("a.hdr"));
  grid.index_to_world =
      affine(grid.index_to_world.linear().colwise().norm().asDiagonal(), {0, 0, 0});
  expect_volume(volume, grid);
  EXPECT_EQ(volume.source().format, "Analyze 7.5");
  ASSERT_EQ(volume.source().notes.size(), 1u);
  EXPECT_NE(volume.source().notes[0].find("no orientation"), std::string::npos);
}

}  // namespace
}  // namespace surf::volume
