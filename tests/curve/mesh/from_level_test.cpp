#include "libcurve/mesh/from_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libcurve/mesh/verify.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve {
namespace {

double area(const Segments& curves) {
  return fem::Geometry<2>(curves.points, curves.elements).enclosed();
}

std::vector<float> cone(const std::array<int, 2>& size, const Eigen::Vector2d& center) {
  std::vector<float> values;
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i)
      values.push_back(float(-(Eigen::Vector2d(i, j) - center).norm()));
  return values;
}

TEST(CurveOfLevel, IsTheCircleOfACone) {
  const Segments circle =
      curve_of_level(cone({40, 50}, {18, 26}), {40, 50}, Eigen::Affine2d::Identity(), -12.3);
  EXPECT_TRUE(verify(circle).passed()) << verify(circle).message();
  for (const auto point : circle.points.rowwise())
    EXPECT_NEAR((point.transpose() - Eigen::Vector2d(18, 26)).norm(), 12.3, 0.05);
  EXPECT_NEAR(area(circle), std::numbers::pi * 12.3 * 12.3, 1);
}

TEST(CurveOfLevel, HasTheDomainOnTheLeftInMirroredImagesToo) {
  const Eigen::Affine2d mirrored(Eigen::Scaling(-2.0, 0.5));
  const Segments circle = curve_of_level(cone({40, 50}, {18, 26}), {40, 50}, mirrored, -12.3);
  EXPECT_TRUE(verify(circle).passed()) << verify(circle).message();
  EXPECT_NEAR(area(circle), std::numbers::pi * 12.3 * 12.3, 1);
}

TEST(CurveOfLevel, IsClosedHalfAStepOutsideTheGrid) {
  const std::vector<float> all(12, 1.f);
  const Segments box = curve_of_level(all, {3, 4}, Eigen::Affine2d::Identity(), 0.5);
  EXPECT_TRUE(verify(box).passed()) << verify(box).message();
  EXPECT_EQ(box.points.col(0).minCoeff(), -0.5);
  EXPECT_EQ(box.points.col(1).maxCoeff(), 3.5);
}

TEST(CurveOfLevel, IsSimpleForEveryPatternOfNodes) {
  for (int pattern = 0; pattern < 1 << 12; ++pattern) {
    std::vector<float> values;
    for (int bit = 0; bit < 12; ++bit) values.push_back(float(pattern >> bit & 1));
    const Segments curves = curve_of_level(values, {4, 3}, Eigen::Affine2d::Identity(), 0.5);
    if (pattern == 0)
      EXPECT_EQ(curves.elements.rows(), 0);
    else
      ASSERT_TRUE(verify(curves).passed()) << pattern << ": " << verify(curves).message();
  }
}

}  // namespace
}  // namespace surf::curve
