#include "libcurve/image/slice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve {
namespace {

/// A volume that holds a linear function of the world, so that every slice can be checked.
volume::Volume volume_of(const Eigen::Matrix3d& linear) {
  Eigen::Affine3d affine = Eigen::Affine3d::Identity();
  affine.linear() = linear;
  affine.translation() << -10, 5, 3;
  std::vector<float> values;
  for (int k = 0; k < 7; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 5; ++i) {
        const Eigen::Vector3d x = affine * Eigen::Vector3d(i, j, k);
        values.push_back(static_cast<float>(x[0] + 10 * x[1] + 100 * x[2]));
      }
  return {{5, 6, 7}, affine, values};
}

double value_at(const Eigen::Vector3d& x) { return x[0] + 10 * x[1] + 100 * x[2]; }

std::vector<Eigen::Matrix3d> grids() {
  Eigen::Matrix3d permuted, sheared, oblique;
  permuted << 0, 0, -2, 1.5, 0, 0, 0, -1, 0;
  sheared << 1, 0.2, 0, 0, 1.5, 0.1, 0, 0, 2;
  oblique = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()) *
            Eigen::Vector3d(-1, 1.5, 2).asDiagonal();
  return {Eigen::Matrix3d::Identity(), permuted, sheared, oblique};
}

TEST(VoxelSlices, PixelsLieWhereTheirVoxelsDo) {
  for (const Eigen::Matrix3d& grid : grids())
    for (const auto plane : {SlicePlane::kAxial, SlicePlane::kSagittal, SlicePlane::kCoronal}) {
      const VoxelSlices slices(volume_of(grid), plane);
      const Image image = slices.slice(2);
      for (int j = 0; j < image.size()[1]; ++j)
        for (int i = 0; i < image.size()[0]; ++i) {
          const Eigen::Vector2d p = image.pixel_to_plane() * Eigen::Vector2d(i, j);
          const Eigen::Vector3d x = *image.plane_to_ras() * Eigen::Vector3d(p[0], p[1], 0);
          ASSERT_NEAR(image.value(i, j), value_at(x), 1e-3);
          const auto voxel = slices.voxel(i, j, 2);
          ASSERT_EQ(slices.volume().value(voxel[0], voxel[1], voxel[2]), image.value(i, j));
        }
      const Eigen::Matrix3d frame = image.plane_to_ras()->linear();
      EXPECT_LT((frame.transpose() * frame - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_EQ(slices.nearest(*image.plane_to_ras() * Eigen::Vector3d(0.1, 0.1, 0)), 2);
    }
}

// A square of a plane, seen from another frame: the same plane turned and from behind, and one that
// is tilted.
TEST(Carried, CurvesStayInTheirPlaceInTheWorld) {
  Segments square{Points<2>(4, 2), Elements<2>(4, 2)};
  square.points << 0, 0, 4, 0, 4, 4, 0, 4;
  square.elements << 0, 1, 1, 2, 2, 3, 3, 0;
  Eigen::Affine3d from(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  from.pretranslate(Eigen::Vector3d(5, -6, 7));
  for (const double behind : {0.0, M_PI}) {
    const Eigen::Affine3d to = from * Eigen::Translation3d(3, 1, 0.2) *
                               Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(behind, Eigen::Vector3d::UnitX());
    const Segments there = carried(square, from, to);
    for (int n = 0; n < 4; ++n) {
      const Eigen::Vector3d is = to * Eigen::Vector3d(there.points(n, 0), there.points(n, 1), 0),
                            was = from *
                                  Eigen::Vector3d(square.points(n, 0), square.points(n, 1), 0.2);
      EXPECT_LT((is - was).norm(), 1e-12);
    }
    EXPECT_NEAR(fem::Geometry<2>(there.points, there.elements).enclosed(), 16, 1e-12);
    const PlaneOffset offset = plane_offset(square, from, to);
    EXPECT_NEAR(offset.most_mm, 0.2, 1e-12);
    EXPECT_NEAR(offset.angle_deg, 0, 1e-6);
  }
  const Eigen::Affine3d tilted = from * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  const PlaneOffset offset = plane_offset(square, from, tilted);
  EXPECT_NEAR(offset.most_mm, 4 * std::sin(0.1), 1e-12);
  EXPECT_NEAR(offset.angle_deg, 0.1 * 180 / M_PI, 1e-9);
  EXPECT_EQ(carried(square, from, from).points, square.points);
}

TEST(VoxelSlices, AreAsThickAsNeighboursAreApart) {
  for (const Eigen::Matrix3d& grid : grids())
    for (const auto plane : {SlicePlane::kAxial, SlicePlane::kSagittal, SlicePlane::kCoronal}) {
      const VoxelSlices slices(volume_of(grid), plane);
      const Image image = slices.slice(2);
      const Eigen::Vector3d next = slices.slice(3).plane_to_ras()->translation();
      EXPECT_NEAR(std::abs((image.plane_to_ras()->inverse() * next)[2]), image.thickness_mm(),
                  1e-12);
    }
  const auto oblique = oblique_slice(volume_of(Eigen::Matrix3d::Identity()), {-8, 7, 5}, {1, 1, 1});
  EXPECT_DOUBLE_EQ(oblique.thickness_mm(), oblique.pixel_size());
}

TEST(VoxelSlices, AreSeenAsRadiologistsDo) {
  const VoxelSlices axial(volume_of(Eigen::Matrix3d::Identity()), SlicePlane::kAxial);
  EXPECT_EQ(axial.n_slices(), 7);
  const Eigen::Matrix3d frame = axial.slice(0).plane_to_ras()->linear();
  EXPECT_TRUE(frame.col(0).isApprox(Eigen::Vector3d(-1, 0, 0)));  // columns to the left
  EXPECT_TRUE(frame.col(1).isApprox(Eigen::Vector3d(0, -1, 0)));  // rows to the back
  const VoxelSlices sagittal(volume_of(Eigen::Matrix3d::Identity()), SlicePlane::kSagittal);
  EXPECT_EQ(sagittal.n_slices(), 5);
  EXPECT_TRUE(
      sagittal.slice(0).plane_to_ras()->linear().col(1).isApprox(Eigen::Vector3d(0, 0, -1)));
  EXPECT_THROW(axial.slice(7), InputError);
  EXPECT_THROW(axial.slice(-1), InputError);
}

// Linear interpolation is exact for the linear function.
TEST(ObliqueSlice, InterpolatesThePlane) {
  const volume::Volume volume = volume_of(Eigen::Vector3d(1, 1.5, 2).asDiagonal());
  const Eigen::Vector3d point = volume.index_to_world() * Eigen::Vector3d(2, 2.5, 3);
  for (const Eigen::Vector3d& normal :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, 0.5), Eigen::Vector3d(1, 0, 0)}) {
    const Image image = oblique_slice(volume, point, normal, 0.5);
    int n_inside = 0;
    for (int j = 0; j < image.size()[1]; ++j)
      for (int i = 0; i < image.size()[0]; ++i) {
        const Eigen::Vector3d x = *image.plane_to_ras() * Eigen::Vector3d(0.5 * i, 0.5 * j, 0);
        ASSERT_NEAR((x - point).dot(normal), 0, 1e-9);
        const Eigen::Array3d index = volume.world_to_index() * x;
        if ((index < 0).any() || (index > Eigen::Array3d(4, 5, 6)).any()) continue;
        ++n_inside;
        ASSERT_NEAR(image.value(i, j), value_at(x), 1e-3);
      }
    EXPECT_GT(n_inside, 50);
  }
  EXPECT_THROW(oblique_slice(volume, {900, 0, 0}, {1, 0, 0}), UsageError);
  EXPECT_THROW(oblique_slice(volume, point, {0, 0, 0}), UsageError);
}

// Half way between a voxel of label 2 and one of 0 lay a label 1.
TEST(ObliqueSlice, HasNoLabelsThatNoVoxelHas) {
  std::vector<float> labels(5 * 6 * 7);
  for (std::size_t at = 0; at < labels.size(); ++at) labels[at] = at / 30 == 3 ? 2 : 0;
  const volume::Volume volume({5, 6, 7}, Eigen::Affine3d::Identity(), labels);
  for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, 3)}) {
    const Image image = oblique_slice(volume, {2, 2.5, 3.5}, normal, 0.5, BetweenVoxels::kNearest);
    for (const float label : image.values()) EXPECT_TRUE(label == 0 || label == 2) << label;
    for (int j = 0; j < image.size()[1]; ++j)
      for (int i = 0; i < image.size()[0]; ++i) {
        const double z = (*image.plane_to_ras() * Eigen::Vector3d(0.5 * i, 0.5 * j, 0))[2];
        if (std::abs(std::abs(z - 3) - 0.5) < 0.01) continue;
        EXPECT_EQ(image.value(i, j), std::abs(z - 3) < 0.5 ? 2 : 0);
      }
  }
}

}  // namespace
}  // namespace surf::curve
