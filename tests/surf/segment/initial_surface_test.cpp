#include "libsurf/segment/initial_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"

namespace surf::segment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

volume::Volume volume_of(const Matrix3d& linear) {
  Eigen::Affine3d affine(Eigen::Translation3d(-20, -20, -20));
  affine.linear() = linear;
  return {{41, 41, 41}, affine, std::vector<float>(41 * 41 * 41, 0.0f)};
}

void expect_good(const InitialSurface& initial, double volume_mm3, double tolerance) {
  EXPECT_TRUE(mesh::verify(initial.surface).passed());
  EXPECT_NEAR(mesh::volume_mm3(initial.surface), volume_mm3, tolerance * volume_mm3);
  ASSERT_TRUE(initial.center_ras_mm);
}

TEST(InitialSurface, HasShortEnoughEdgesWhereTheBodyIsSmall) {
  constexpr double kLong = 100, kBall = 4 * std::numbers::pi / 3;
  expect_good(initial_ball({1, 2, 3}, 2, kLong), kBall * 8, 0.2);
  const Matrix3d axes = Vector3d(9, 2, 4).asDiagonal();
  expect_good(initial_ellipsoid({1, 2, 3}, axes, kLong), kBall * 72, 0.2);
  expect_good(initial_box({0, 0, 0}, {8, 1, 3}, Matrix3d::Identity(), kLong), 24, 1e-12);
}

TEST(InitialSurface, BoxTurnsOutwardAlongAnyAxes) {
  const Matrix3d turned = Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).matrix();
  const Matrix3d mirrored = turned * Vector3d(-1, 1, 1).asDiagonal();
  for (const Matrix3d& axes : {turned, mirrored}) {
    const Vector3d a(1, 2, 3), b = a + axes * Vector3d(5, -4, 3);
    const InitialSurface box = initial_box(a, b, axes, 1);
    expect_good(box, 60, 1e-9);
    EXPECT_LT((*box.center_ras_mm - (a + b) / 2).norm(), 1e-12);
    EXPECT_LT((mesh::centroid(box.surface) - (a + b) / 2).norm(), 1e-9);
  }
}

TEST(InitialSurface, IsFittedToPointsOnTheObject) {
  const Triangles ball = mesh::ball({3, -2, 1}, 6, 4);
  const InitialSurface fit = fitted_ellipsoid(ball.points, 1);
  expect_good(fit, 4 * std::numbers::pi / 3 * 216, 0.05);
  EXPECT_LT((*fit.center_ras_mm - Vector3d(3, -2, 1)).norm(), 1e-3);
}

TEST(InitialSurface, VoxelAxesAreUnitVectorsAlongTheIndices) {
  Matrix3d grid;
  grid << 0, 0, -2, 1.5, 0, 0, 0, -1, 0;
  Matrix3d expected;
  expected << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  EXPECT_LT((voxel_axes(volume_of(grid)) - expected).norm(), 1e-15);
}

// The volume is [-20.5, 20.5]^3 mm; no vertex lies in it.
TEST(InitialSurface, MayPassThroughTheVolumeOrEncloseItByLargeTriangles) {
  const volume::Volume volume = volume_of(Matrix3d::Identity());
  EXPECT_NO_THROW(check_initial(mesh::box({-100, -100, -100}, {100, 100, 100}, 100), volume));
  EXPECT_NO_THROW(check_initial(mesh::box({-100, -3, -3}, {100, 3, 3}, 200), volume));
  EXPECT_THROW(check_initial(mesh::box({30, -100, -100}, {100, 100, 100}, 200), volume),
               InputError);
}

TEST(InitialSurface, IsRefusedIfItIsOpenOrElsewhere) {
  const volume::Volume volume = volume_of(Matrix3d::Identity());
  Triangles ball = mesh::ball({0, 0, 0}, 5, 2);
  EXPECT_NO_THROW(check_initial(ball, volume));
  EXPECT_THROW(check_initial(mesh::ball({90, 0, 0}, 5, 2), volume), InputError);
  ball.elements.conservativeResize(ball.elements.rows() - 1, 3);
  EXPECT_THROW(check_initial(ball, volume), InputError);
}

}  // namespace
}  // namespace surf::segment
