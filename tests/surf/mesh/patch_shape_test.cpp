#include "libsurf/mesh/detail/patch_shape.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

const Corners kTriangle = {Vector3d(0, 0, 0), Vector3d(2, 0, 0), Vector3d(0, 2, 0)};

TEST(PatchShape, DistanceIsToThePlaneAboveTheTriangleAndToASideOrCornerBesideIt) {
  EXPECT_EQ(squared_distance({0.5, 0.5, 3}, kTriangle), 9);
  EXPECT_EQ(squared_distance({1, -2, 0}, kTriangle), 4);
  EXPECT_EQ(squared_distance({-3, -4, 0}, kTriangle), 25);
  EXPECT_NEAR(squared_distance({2, 2, 1}, kTriangle), 3, 1e-15);
}

TEST(PatchShape, NothingIsNearATriangleWithoutArea) {
  const Corners line = {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)};
  EXPECT_GT(squared_distance({1, 0, 0}, line), 1e300);
}

TEST(PatchShape, ClosestIsTheFirstOfEqualTriangles) {
  const Corners far = {Vector3d(9, 0, 0), Vector3d(11, 0, 0), Vector3d(9, 2, 0)};
  EXPECT_EQ(closest({0, 0, 1}, {far, kTriangle, kTriangle}), 1u);
  EXPECT_TRUE(is_near({0, 0, 1}, {far, kTriangle}, 1));
  EXPECT_FALSE(is_near({0, 0, 1.01}, {far, kTriangle}, 1));
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
