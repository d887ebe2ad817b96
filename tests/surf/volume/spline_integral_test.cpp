#include "libsurf/volume/spline_integral.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surf::volume {
namespace {

constexpr std::array<int, 3> kSize = {21, 35, 18};

Grid grid() {
  Eigen::Affine3d affine = Eigen::Translation3d(3, -7, 2) *
                           Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, -1).normalized()) *
                           Eigen::Scaling(0.7, -1.1, 2.5);
  return {kSize, affine};
}

/// Waves that are shorter and longer than tiles.
void values(const std::array<int, 3>& lower, const std::array<int, 3>& upper, float* out) {
  for (int k = lower[2]; k < upper[2]; ++k)
    for (int j = lower[1]; j < upper[1]; ++j)
      for (int i = lower[0]; i < upper[0]; ++i)
        *out++ = static_cast<float>(5 + std::sin(1.3 * i + 0.4 * j) * std::cos(0.9 * k - 2.1 * j));
}

/// int I du_1 between two values of u_1, by Gauss's rule on parts of cells.
double integral(const Field<3>& I, const Eigen::Vector3d& u, double from, double to) {
  constexpr int kParts = 400;
  Points<3> x(2 * kParts, 3);
  for (int n = 0; n < kParts; ++n)
    for (int p = 0; p < 2; ++p) {
      Eigen::Vector3d at = u;
      at[0] = from + (to - from) * (n + 0.5 + (p - 0.5) / std::sqrt(3.0)) / kParts;
      x.row(2 * n + p) = grid().index_to_world * at;
    }
  Samples<3> samples;
  I.sample(x, Derivatives::kNone, samples);
  return samples.value.sum() * (to - from) / (2 * kParts);
}

TEST(SplineIntegral, IsThatOfTheFieldOfTheSameValues) {
  const TiledField I(grid(), values);
  const SplineIntegral P(grid(), values);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  for (int n = 0; n < 200; ++n) {
    // Up to the outer faces, and beyond them along the rows.
    Eigen::Vector3d u;
    for (int axis = 0; axis < 3; ++axis) u[axis] = -0.5 + part(random) * kSize[axis];
    const double from = -2 + part(random) * (kSize[0] + 4), to = -2 + part(random) * (kSize[0] + 4);
    Points<3> ends(2, 3);
    for (const auto& [row, at] : {std::pair(0, from), std::pair(1, to)}) {
      u[0] = at;
      ends.row(row) = grid().index_to_world * u;
    }
    Samples<3> samples;
    P.sample(ends, Derivatives::kNone, samples);
    EXPECT_NEAR(samples.value[1] - samples.value[0], integral(I, u, from, to), 3e-5)
        << u.transpose() << ", from " << from << " to " << to;
  }
}

}  // namespace
}  // namespace surf::volume
