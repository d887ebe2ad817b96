#include "libsurf/mesh/detail/patch_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

const Corners kTriangle = {Vector3d(0, 0, 0), Vector3d(2, 0, 0), Vector3d(0, 2, 0)};

/// Whether that, but for rounding, is the distance from the triangle.
void expect_distance(const Vector3d& point, double distance) {
  const std::vector<Corners> patch = {kTriangle};
  EXPECT_TRUE(NearPatch(patch).is_near(point, distance + 1e-12)) << point.transpose();
  EXPECT_FALSE(NearPatch(patch).is_near(point, distance - 1e-12)) << point.transpose();
}

TEST(PatchShape, DistanceIsToThePlaneAboveTheTriangleAndToASideOrCornerBesideIt) {
  expect_distance({0.5, 0.5, 3}, 3);
  expect_distance({1, -2, 0}, 2);
  expect_distance({-3, -4, 0}, 5);
  expect_distance({2, 2, 1}, std::sqrt(3));
}

TEST(PatchShape, NothingIsNearATriangleWithoutArea) {
  const std::vector<Corners> line = {{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)}};
  EXPECT_FALSE(NearPatch(line).is_near({1, 0, 0}, 1e100));
}

TEST(PatchShape, ClosestIsTheFirstOfEqualTriangles) {
  const Corners far = {Vector3d(9, 0, 0), Vector3d(11, 0, 0), Vector3d(9, 2, 0)};
  const std::vector<Corners> twice = {far, kTriangle, kTriangle}, both = {far, kTriangle};
  EXPECT_EQ(NearPatch(twice).closest({0, 0, 1}), 1u);
  EXPECT_EQ(NearPatch(twice).closest({10, 0, 1}), 0u);
  EXPECT_TRUE(NearPatch(both).is_near({0, 0, 1}, 1));
  EXPECT_FALSE(NearPatch(both).is_near({0, 0, 1.01}, 1));
}

/// Triangles that are left out for their balls are none that count.
TEST(PatchShape, ClosestOfManyIsTheOneThatIsNearestByItself) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const auto draw = [&] {
    return Vector3d(coordinate(random), coordinate(random), coordinate(random));
  };
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::vector<Corners> patch(12);
    for (Corners& t : patch) {
      const Vector3d at = draw();
      t = {at + 0.3 * draw(), at + 0.3 * draw(), at + 0.3 * draw()};
    }
    const Vector3d point = 2 * draw();
    const std::size_t closest = NearPatch(patch).closest(point);
    const std::vector<Corners> closest_alone = {patch[closest]};
    double low = 0, high = 8;  // bisection for the distance from the closest one
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (NearPatch(closest_alone).is_near(point, middle) ? high : low) = middle;
    }
    for (const Corners& t : patch) {
      const std::vector<Corners> alone = {t};
      EXPECT_FALSE(NearPatch(alone).is_near(point, low - 1e-9));
    }
    EXPECT_TRUE(NearPatch(patch).is_near(point, high + 1e-9));
    EXPECT_FALSE(NearPatch(patch).is_near(point, low - 1e-9));
  }
}

TEST(PatchShape, SharpestIsTheCosineOfTheSmallestAngle) {
  EXPECT_NEAR(sharpest({kTriangle}), std::sqrt(0.5), 1e-15);
  EXPECT_EQ(longest_spoke({kTriangle}), 2);
}

TEST(PatchShape, NormalsTurnTooFarBeyondSixtyDegreesOrIfTheyAreNoNumbers) {
  EXPECT_FALSE(turns_too_far({0, 0, 3}, {0, std::sin(1.04), std::cos(1.04)}));
  EXPECT_TRUE(turns_too_far({0, 0, 3}, {0, std::sin(1.05), std::cos(1.05)}));
  EXPECT_FALSE(turns_too_far({0, 0, 0}, {0, 0, 1}));
  EXPECT_TRUE(turns_too_far({0, 0, 1}, {std::nan(""), 0, 0}));
}

}  // namespace
}  // namespace surf::mesh
