#include "libsurf/mesh/triangle_shape.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(TriangleShape, WithoutAreaHasAnglesOfZeroAnd180Degrees) {
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0);
  for (const Eigen::Vector3d& c : {a, b, Eigen::Vector3d(0.5, 0, 0), Eigen::Vector3d(3, 0, 0)}) {
    const AngleCosines cosines = angle_cosines(a, b, c);
    EXPECT_DOUBLE_EQ(cosines.widest, -1);
    EXPECT_DOUBLE_EQ(cosines.sharpest, 1);
  }
}

}  // namespace
}  // namespace surf::mesh
