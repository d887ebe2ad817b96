#include "libsurf/mesh/triangle_shape.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

constexpr double kRounding = 1e-12;

TEST(TriangleShape, OfARightTriangleWithLegsOneAndRootThree) {
  const Eigen::Vector3d a(1, 1, 1), b(2, 1, 1), c(1, 1 + std::sqrt(3.0), 1);
  EXPECT_NEAR((area_normal(a, b, c) - Eigen::Vector3d(0, 0, std::sqrt(3.0))).norm(), 0, kRounding);
  const AngleCosines cosines = angle_cosines(a, b, c);
  EXPECT_NEAR(cosines.widest, cos_deg(90), kRounding);
  EXPECT_NEAR(cosines.sharpest, cos_deg(30), kRounding);
}

TEST(TriangleShape, AnglesNearZeroAreExact) {
  EXPECT_NEAR(angle_between({1, 0, 0}, {1, 1e-9, 0}), 1e-9, 1e-18);
  EXPECT_NEAR(angle_between({1, 0, 0}, {-1, 0, 0}), std::numbers::pi, kRounding);
}

TEST(TriangleShape, WithoutAreaHasAnglesOfZeroAnd180Degrees) {
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0);
  for (const Eigen::Vector3d& c : {a, b, Eigen::Vector3d(0.5, 0, 0), Eigen::Vector3d(3, 0, 0)}) {
    const AngleCosines cosines = angle_cosines(a, b, c);
    EXPECT_DOUBLE_EQ(cosines.widest, -1);
    EXPECT_DOUBLE_EQ(cosines.sharpest, 1);
  }
}

TEST(TriangleShape, AnglesOfAFaceAreThoseAtItsVerticesAndAddUpTo180Degrees) {
  const TriMesh mesh = to_mesh(some_surface(2));
  const Points<3> angles = angles_deg(mesh);
  ASSERT_EQ(angles.rows(), Eigen::Index(mesh.n_faces()));
  EXPECT_LT((angles.rowwise().sum().array() - 180).abs().maxCoeff(), 1e-10);
}

TEST(TriangleShape, VolumeAndAreaOfABoxAreExactWhereverItLies) {
  const Eigen::Vector3d low(100, -50, 20), size(1, 2, 3);
  const TriMesh mesh = to_mesh(box(low, low + size, 0.5));
  EXPECT_NEAR(enclosed_volume(mesh), 6, 6e-12);
  EXPECT_NEAR(surface_area(mesh), 22, 22e-12);
}

}  // namespace
}  // namespace surf::mesh
