#include "libcurve/mesh/rasterize.h"

#include <numeric>

#include "libcurve/mesh/primitives.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

Eigen::Affine2d grid(double spacing, const Vector<2>& first) {
  return Eigen::Translation2d(first) * Eigen::Scaling(spacing);
}

TEST(CurveRasterize, MarksThePixelsWhoseCentresAreInside) {
  const Segments curves = joined({circle({0, 0}, 1, 0.05), flipped(circle({0.2, 0.1}, 0.4, 0.05))});
  Eigen::Affine2d turned = grid(0.0537, {-1.3, -1.2}) * Eigen::Rotation2Dd(0.1);
  turned.linear().col(0) *= -1;  // mirrored
  turned.translation() = Vector<2>(1.3, -1.3);
  for (const Eigen::Affine2d& affine : {grid(0.0537, {-1.3, -1.2}), turned}) {
    const auto mask = rasterize(curves, {50, 52}, affine);
    int n_inside = 0;
    for (int j = 0; j < 52; ++j)
      for (int i = 0; i < 50; ++i) {
        const Winding winding = winding_round(curves, affine * Vector<2>(i, j));
        if (winding.distance < 1e-9) continue;
        EXPECT_EQ(mask[j * 50 + i], winding.number != 0);
        n_inside += winding.number != 0;
      }
    EXPECT_GT(n_inside, 500);
  }
}

TEST(CurveRasterize, GivesCentresOnACurveToTheSideOfGrowingIndices) {
  Points<2> square(4, 2);
  square << 1, 1, 3, 1, 3, 3, 1, 3;
  const auto mask = rasterize(polygon(square, 10), {5, 5}, Eigen::Affine2d::Identity());
  EXPECT_EQ(std::accumulate(mask.begin(), mask.end(), 0), 4);
  EXPECT_EQ(mask[1 * 5 + 1], 1);
  EXPECT_EQ(mask[3 * 5 + 3], 0);
}

TEST(CurveRasterize, FillsAGridThatLiesInside) {
  const auto mask = rasterize(circle({0, 0}, 100, 1), {7, 3}, Eigen::Affine2d::Identity());
  EXPECT_EQ(std::accumulate(mask.begin(), mask.end(), 0), 21);
}

}  // namespace
}  // namespace surf::curve
