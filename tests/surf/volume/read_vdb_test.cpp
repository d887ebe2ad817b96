#include "libsurf/volume/detail/read_vdb.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <fstream>
#include <limits>
#include <random>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

openvdb::math::Mat4d transposed(const Eigen::Affine3d& matrix) {
  openvdb::math::Mat4d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result[row][column] = matrix.matrix()(column, row);
  return result;
}

/// All voxels active from `first` on; the grid's transform is such that `first` is voxel 0, 0, 0.
template <class GridType>
typename GridType::Ptr grid_of(const Grid& grid, const openvdb::Coord& first) {
  Eigen::Affine3d transform = grid.index_to_world;
  transform.translate(-Eigen::Vector3d(first.x(), first.y(), first.z()));
  auto result = GridType::create();
  result->setTransform(openvdb::math::Transform::createLinearTransform(transposed(transform)));
  auto accessor = result->getAccessor();
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        accessor.setValue(first.offsetBy(i, j, k),
                          static_cast<typename GridType::ValueType>(value_at(i, j, k)));
  return result;
}

class ReadVdb : public Files {
 protected:
  ReadVdb() { openvdb::initialize(); }

  std::string save(const openvdb::GridCPtrVec& grids_to_write, const std::string& name) const {
    openvdb::io::File file(path(name));
    file.write(grids_to_write);
    return path(name);
  }
};

TEST_F(ReadVdb, TransformIsTheWorldAndTheActiveBoxTheVolume) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    const Volume volume =
        read_volume(save({grid_of<openvdb::FloatGrid>(grid, {-5, 12, 3})}, "a.vdb"));
    expect_volume(volume, grid);
    EXPECT_EQ(volume.source().scalar_type, "float32");
  }
}

TEST_F(ReadVdb, DoublesAndWholeNumbersAreRead) {
  const Grid grid = grids()[1];
  expect_volume(read_volume(save({grid_of<openvdb::DoubleGrid>(grid, {0, 0, 0})}, "a.vdb")), grid);
  expect_volume(read_volume(save({grid_of<openvdb::Int32Grid>(grid, {9, 0, 0})}, "b.vdb")), grid);
  expect_volume(read_volume(save({grid_of<openvdb::Int64Grid>(grid, {0, -9, 0})}, "c.vdb")), grid);
}

TEST_F(ReadVdb, FirstScalarGridIsTakenWithANote) {
  const Grid grid = grids()[0];
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->tree().setValue({0, 0, 0}, openvdb::Vec3s(1, 2, 3));
  const auto scalars = grid_of<openvdb::FloatGrid>(grid, {0, 0, 0});
  scalars->setName("density");
  const Volume volume = read_volume(save({vectors, scalars}, "a.vdb"));
  expect_volume(volume, grid);
  EXPECT_EQ(volume.source().notes.size(), 2u);
  EXPECT_NE(failure(save({vectors}, "b.vdb")).find("has no scalar grid"), std::string::npos);
}

TEST_F(ReadVdb, TheEndOfIndicesIsRefused) {
  const auto far = openvdb::FloatGrid::create();
  far->tree().addTile(1, {std::numeric_limits<int>::max(), 0, 0}, 1, true);
  EXPECT_NE(failure(save({far}, "a.vdb")).find("at index 2147483640 and 2147483647, beyond 2^30"),
            std::string::npos);
}

TEST_F(ReadVdb, EmptyGridIsRefused) {
  EXPECT_NE(failure(save({openvdb::FloatGrid::create()}, "a.vdb")).find("no active voxels"),
            std::string::npos);
}

TEST_F(ReadVdb, TruncatedAtAnyPlaceIsOneMessage) {
  const std::string bytes =
      read(save({grid_of<openvdb::FloatGrid>(grids()[0], {0, 0, 0})}, "a.vdb"));
  for (std::size_t n = 4; n < bytes.size(); n += bytes.size() / 23) {
    const std::string message = failure(write("b.vdb", bytes.substr(0, n)));
    EXPECT_TRUE(message.starts_with(path("b.vdb") + ": ")) << n << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

/// All that a tree may hold: voxels on both sides of 0, in four nodes of the root; tiles of two
/// sizes; inactive voxels of one value, of two, of the negative background's and of many.
template <class GridType>
typename GridType::Ptr motley_grid() {
  using Value = typename GridType::ValueType;
  auto out = GridType::create(Value(3));
  std::mt19937 random(7);  // NOLINT: the same in every run
  const auto at = [&](int first) {
    return openvdb::Coord(first + int(random() % 8), int(random() % 8), int(random() % 8));
  };
  out->tree().addTile(2, {-1, 0, 0}, Value(-3), false);
  out->tree().addTile(1, {8, 0, 0}, Value(9), true);
  out->tree().addTile(1, {8, 8, 0}, Value(5), false);
  for (int leaf = -4; leaf < 5; ++leaf) {  // with that many values of inactive voxels
    if (leaf == 1) continue;               // there is the tile
    for (int n = 0; n < 100; ++n) out->tree().setValue(at(8 * leaf), Value(random() % 1000) / 8);
    for (int n = 0; n < 40 * std::abs(leaf); ++n)
      out->tree().setValueOff(at(8 * leaf), Value(leaf < 0 ? -3 : 40 + n % leaf));
  }
  for (int i = 40; i < 48; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 8; ++k) out->tree().setValue({i, j - 8, k - 8}, Value(7 * i - j * k));
  return out;
}

template <class GridType>
void expect_same(const Volume& volume, const GridType& grid) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const openvdb::Coord size = box.dim();
  ASSERT_EQ(volume.size(), (std::array{size.x(), size.y(), size.z()}));
  int n_wrong = 0;
  for (auto at = box.begin(); at != box.end(); ++at) {
    const openvdb::Coord index = *at - box.min();
    n_wrong += volume.value(index.x(), index.y(), index.z()) != float(grid.tree().getValue(*at));
  }
  EXPECT_EQ(n_wrong, 0) << "of " << box.volume() << " voxels";
}

template <class GridType>
void check_all_packings(const std::string& path) {
  using namespace openvdb::io;
  constexpr std::uint32_t kPackings[] = {COMPRESS_NONE,
                                         COMPRESS_ZIP,
                                         COMPRESS_BLOSC,
                                         COMPRESS_ACTIVE_MASK,
                                         COMPRESS_ZIP | COMPRESS_ACTIVE_MASK,
                                         COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK};
  for (const std::uint32_t packing : kPackings)
    for (const bool is_half : {false, true}) {
      SCOPED_TRACE(compressionToString(packing) + (is_half ? ", halves" : ""));
      const auto grid = motley_grid<GridType>();
      grid->setSaveFloatAsHalf(is_half);
      File out(path);
      out.setCompression(packing);
      out.write(openvdb::GridCPtrVec{grid});
      File in(path);
      in.open();
      const auto own = openvdb::gridPtrCast<GridType>(in.readGrid(in.beginName().gridName()));
      expect_same(read_volume(path), *own);
    }
}

TEST_F(ReadVdb, WhatOpenVdbWritesIsReadAsItReadsIt) {
  check_all_packings<openvdb::FloatGrid>(path("float.vdb"));
  check_all_packings<openvdb::DoubleGrid>(path("double.vdb"));
  check_all_packings<openvdb::Int32Grid>(path("int32.vdb"));
  check_all_packings<openvdb::Int64Grid>(path("int64.vdb"));
}

TEST_F(ReadVdb, TransformsOfEveryKindAreTheWorld) {
  using namespace openvdb::math;
  const std::pair<MapBase::Ptr, Eigen::Affine3d> maps[] = {
      {std::make_shared<UniformScaleMap>(2), affine(2 * Eigen::Matrix3d::Identity(), {0, 0, 0})},
      {std::make_shared<ScaleMap>(Vec3d(1, 2, 3)),
       affine(Eigen::Vector3d(1, 2, 3).asDiagonal(), {0, 0, 0})},
      {std::make_shared<TranslationMap>(Vec3d(4, 5, 6)),
       affine(Eigen::Matrix3d::Identity(), {4, 5, 6})},
      {std::make_shared<ScaleTranslateMap>(Vec3d(1, 2, 3), Vec3d(4, 5, 6)),
       affine(Eigen::Vector3d(1, 2, 3).asDiagonal(), {4, 5, 6})},
      {std::make_shared<UniformScaleTranslateMap>(2, Vec3d(4, 5, 6)),
       affine(2 * Eigen::Matrix3d::Identity(), {4, 5, 6})},
      {std::make_shared<UnitaryMap>(Vec3d(0, 0, 1), 0.5),
       affine(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {0, 0, 0})}};
  for (const auto& [map, index_to_world] : maps) {
    SCOPED_TRACE(map->type());
    const Grid grid = {map->type(), {4, 3, 5}, index_to_world};
    const auto written = grid_of<openvdb::FloatGrid>(grid, {0, 0, 0});
    written->transform() = Transform(map);
    expect_volume(read_volume(save({written}, "a.vdb")), grid);
  }
  const auto frustum = grid_of<openvdb::FloatGrid>(grids()[0], {0, 0, 0});
  frustum->setTransform(
      Transform::createFrustumTransform(openvdb::BBoxd(Vec3d(0), Vec3d(10)), 0.5, 10, 1));
  EXPECT_NE(failure(save({frustum}, "b.vdb")).find("has a frustum for a transform"),
            std::string::npos);
}

TEST_F(ReadVdb, LevelSetsAndCopiesAreToldInNotes) {
  const Grid grid = grids()[0];
  const auto first = grid_of<openvdb::FloatGrid>(grid, {0, 0, 0});
  first->setGridClass(openvdb::GRID_LEVEL_SET);
  first->insertMeta("long", openvdb::StringMetadata(std::string(100'000, 'x')));
  const openvdb::GridBase::Ptr copy = first->copyGrid();  // of the same tree
  const Volume volume = read_volume(save({first, copy}, "a.vdb"));
  expect_volume(volume, grid);
  ASSERT_EQ(volume.source().notes.size(), 3u);
  EXPECT_EQ(volume.source().notes[1], "2 grids in the file, read ''");
  EXPECT_EQ(volume.source().notes[2], "a level set: values are distances, not intensities");
}

TEST_F(ReadVdb, StreamsWithoutOffsetsAreRead) {
  const Grid grid = grids()[0];
  const auto vectors = openvdb::Vec3SGrid::create();
  const auto stream = [&](const openvdb::GridCPtrVec& written) {
    std::ofstream file(path("a.vdb"), std::ios::binary);
    openvdb::io::Stream(file).write(written);
    return path("a.vdb");
  };
  expect_volume(read_volume(stream({grid_of<openvdb::FloatGrid>(grid, {0, 0, 0}), vectors})), grid);
  EXPECT_NE(
      failure(stream({vectors, grid_of<openvdb::FloatGrid>(grid, {0, 0, 0})}))
          .find("has no scalar grid (float, double, int32, int64) at its begin, but '' (vec3s"),
      std::string::npos);
}

TEST_F(ReadVdb, OtherFormatsAreNamed) {
  const auto intact = read(save({grid_of<openvdb::FloatGrid>(grids()[0], {0, 0, 0})}, "a.vdb"));
  constexpr std::size_t kFormatAt = 8;
  for (const char format : {'\xdd', '\xe1'}) {  // 221, 225
    std::string bytes = intact;
    bytes[kFormatAt] = format;
    EXPECT_NE(failure(write("b.vdb", bytes)).find("surfseg reads 222 to 224"), std::string::npos);
  }
}

/// Of two nodes in one place OpenVDB's tree frees the first, whose leaves still wait for values.
TEST_F(ReadVdb, NodesOutOfPlaceAreRefused) {
  const auto two = openvdb::FloatGrid::create();
  two->tree().setValue({0, 0, 0}, 1);
  two->tree().setValue({4096, 0, 0}, 2);
  const auto intact = read(save({two}, "a.vdb"));
  const std::string origin = raw_bytes(std::vector<std::int32_t>{4096, 0, 0});
  for (const std::int32_t other :
       {0, -4096, 4104}) {  // the first's, before it, no multiple of 4096
    std::string bytes = intact;
    bytes.replace(bytes.rfind(origin), origin.size(),
                  raw_bytes(std::vector<std::int32_t>{other, 0, 0}));
    EXPECT_NE(failure(write("b.vdb", bytes)).find("its nodes are not in place"), std::string::npos)
        << other;
  }
}

}  // namespace
}  // namespace surf::volume
