#include "libsurf/volume/detail/read_metaimage.h"

#include <fmt/format.h>
#include <zlib.h>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

std::string numbers(const Eigen::Matrix3d& columns) {
  std::string result;
  for (int n = 0; n < 3; ++n)
    result += fmt::format(" {} {} {}", columns(0, n), columns(1, n), columns(2, n));
  return result;
}

/// The header without its last lines; MetaImage is LPS.
std::string header_of(const Grid& grid, const std::string& type) {
  const Eigen::Affine3d lps = Eigen::Scaling(-1.0, -1.0, 1.0) * grid.index_to_world;
  const Eigen::Vector3d spacing = lps.linear().colwise().norm();
  const Eigen::Vector3d offset = lps.translation();
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix ={}\nOffset = {} {} {}\n"
      "CenterOfRotation = 7 7 7\nElementSpacing = {} {} {}\nDimSize = {} {} {}\nElementType = {}\n",
      numbers(lps.linear().colwise().normalized()), offset[0], offset[1], offset[2], spacing[0],
      spacing[1], spacing[2], grid.size[0], grid.size[1], grid.size[2], type);
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  result.resize(size);
  return result;
}

class ReadMetaImage : public Files {};

TEST_F(ReadMetaImage, DirectionsOfAnyKindBecomeRas) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    expect_volume(
        read_volume(write("a.mha", header_of(grid, "MET_SHORT") + "ElementDataFile = LOCAL\n" +
                                       raw_bytes(values<std::int16_t>(grid.size)))),
        grid);
  }
}

TEST_F(ReadMetaImage, EveryScalarTypeIsReadInBothByteOrders) {
  const Grid grid = grids()[0];
  const auto check = [&](const char* type, auto scalar, const char* name) {
    for (const bool is_big : {false, true}) {
      SCOPED_TRACE(type);
      const auto data = values<decltype(scalar)>(grid.size);
      const Volume volume = read_volume(write(
          "a.mha", header_of(grid, type) +
                       fmt::format("BinaryDataByteOrderMSB = {}\n", is_big ? "True" : "False") +
                       "ElementDataFile = LOCAL\n" + raw_bytes(data, is_big)));
      EXPECT_EQ(volume.source().scalar_type, name);
      expect_volume(volume, grid);
    }
  };
  check_scalar_types({"MET_CHAR", "MET_UCHAR", "MET_SHORT", "MET_USHORT", "MET_INT", "MET_UINT",
                      "MET_LONG_LONG", "MET_ULONG_LONG", "MET_FLOAT", "MET_DOUBLE"},
                     check);
}

TEST_F(ReadMetaImage, CompressedDataAreInflated) {
  const Grid grid = grids()[2];
  const std::string data = deflated(raw_bytes(values<std::int16_t>(grid.size)));
  expect_volume(
      read_volume(write("a.mha", header_of(grid, "MET_SHORT") +
                                     fmt::format("CompressedData = True\nCompressedDataSize = {}\n",
                                                 data.size()) +
                                     "ElementDataFile = LOCAL\n" + data)),
      grid);
}

TEST_F(ReadMetaImage, DetachedDataAreFoundBesideTheHeaderAndSkipTheirOwn) {
  const Grid grid = grids()[1];
  const std::string data = raw_bytes(values<std::int16_t>(grid.size));
  write("a.raw", "1234567" + data);
  for (const int n : {7, -1}) {
    const std::string header =
        header_of(grid, "MET_SHORT") + fmt::format("HeaderSize = {}\nElementDataFile = a.raw\n", n);
    expect_volume(read_volume(write("a.mhd", header)), grid);
  }
  EXPECT_EQ(volume_files(path("a.mhd")), (std::vector{path("a.mhd"), path("a.raw")}));
}

TEST_F(ReadMetaImage, FrameOfFourDimensionsIsChosen) {
  const Grid grid{"4-D", {4, 3, 5}, affine(Eigen::Vector3d(-2, -3, 4).asDiagonal(), {-1, -2, 3})};
  const std::string header =
      "NDims = 4\nDimSize = 4 3 5 2\nElementType = MET_SHORT\nElementSpacing = 2 3 4 9\n"
      "Offset = 1 2 3 0\nElementDataFile = LOCAL\n";
  const std::string file = write("a.mha", header + raw_bytes(values<std::int16_t>(grid.size)) +
                                              raw_bytes(values<std::int16_t>(grid.size, 500)));
  expect_volume(read_volume(file, {.frame_index = 1, .series_uid = {}}), grid, 1, 500);
  EXPECT_NE(failure(file, {.frame_index = 2, .series_uid = {}}).find("has 2 frames"),
            std::string::npos);
}

TEST_F(ReadMetaImage, NoTransformMatrixIsLpsWithANote) {
  const Grid grid{"plain", {4, 3, 5}, affine(Eigen::Vector3d(-1, -1, 1).asDiagonal(), {0, 0, 0})};
  const Volume volume = read_volume(write(
      "a.mha", "NDims = 3\nDimSize = 4 3 5\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
                   raw_bytes(values<std::uint8_t>(grid.size))));
  expect_volume(volume, grid);
  EXPECT_EQ(volume.source().notes.size(), 1u);
}

}  // namespace
}  // namespace surf::volume
