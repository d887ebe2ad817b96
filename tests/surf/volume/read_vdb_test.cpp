#include "libsurf/volume/detail/read_vdb.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

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

}  // namespace
}  // namespace surf::volume
