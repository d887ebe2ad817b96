#include "libsurf/fem/trilinear.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace surf::fem {
namespace {

using Vector8 = Eigen::Matrix<double, 8, 1>;

/// Of the box [lower, upper] in the unit cell.
Moments box_moments(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  Moments out;
  const auto integral = [&](int axis, int power) {
    return (std::pow(upper[axis], power + 1) - std::pow(lower[axis], power + 1)) / (power + 1);
  };
  for (int c = 0; c < 3; ++c)
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a)
        out[9 * c + 3 * b + a] = integral(0, a) * integral(1, b) * integral(2, c);
  return out;
}

const Eigen::Vector3d kLower(0.1, 0.3, 0), kUpper(0.8, 0.9, 0.6);
const double kContent = (kUpper - kLower).prod();

Eigen::Vector3d corner(int number) {
  return {double(number & 1), double(number >> 1 & 1), double(number >> 2)};
}

/// Values at the corners.
template <class Function>
Vector8 at_corners(const Function& function) {
  Vector8 out;
  for (int n = 0; n < 8; ++n) out[n] = function(corner(n));
  return out;
}

Eigen::Matrix3d sheared() {
  Eigen::Matrix3d out;
  out << 0.5, 0.2, 0, -0.1, 0.8, 0.3, 0, 0.1, -1.2;
  return out;
}

TEST(Trilinear, MomentsOfTheWholeCellAreThoseOfTheUnitCube) {
  const Moments expected = box_moments({0, 0, 0}, {1, 1, 1});
  for (int n = 0; n < 27; ++n) EXPECT_NEAR(full_moments()[n], expected[n], 1e-15);
}

TEST(Trilinear, MassOfTheWholeCellIsAProductOfThirdsAndSixths) {
  const CellMatrix M = cell_mass(full_moments());
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b) {
      double expected = 1;
      for (int axis = 0; axis < 3; ++axis)
        expected *= corner(a)[axis] == corner(b)[axis] ? 1.0 / 3 : 1.0 / 6;
      EXPECT_NEAR(M(a, b), expected, 1e-15);
    }
}

// 1 and x are trilinear: their products integrate to moments.
TEST(Trilinear, MassOfAPartGivesItsMoments) {
  const CellMatrix M = cell_mass(box_moments(kLower, kUpper));
  const Vector8 one = Vector8::Ones();
  EXPECT_NEAR(one.dot(M * one), kContent, 1e-15);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector8 x = at_corners([&](const Eigen::Vector3d& p) { return p[axis]; });
    const double lower = kLower[axis], upper = kUpper[axis];
    EXPECT_NEAR(one.dot(M * x), kContent * (lower + upper) / 2, 1e-15);
    EXPECT_NEAR(x.dot(M * x), kContent * (lower * lower + lower * upper + upper * upper) / 3,
                1e-15);
  }
  EXPECT_EQ(M, M.transpose());
}

// u = g . x in the world: int |grad u|^2 = |g|^2 |part|, in any frame.
TEST(Trilinear, StiffnessOfALinearFunctionIsItsSquaredGradient) {
  const CellMetric metric(sheared());
  EXPECT_NEAR(metric.volume, std::abs(sheared().determinant()), 1e-15);
  const CellMatrix K = cell_matrix(box_moments(kLower, kUpper), metric, 0, 1);
  const Eigen::Vector3d g(0.7, -0.2, 0.4), h(-0.3, 0.5, 0.1);
  const auto linear = [&](const Eigen::Vector3d& slope) {
    return at_corners([&](const Eigen::Vector3d& p) { return 2 + slope.dot(sheared() * p); });
  };
  EXPECT_NEAR(linear(g).dot(K * linear(h)), g.dot(h) * metric.volume * kContent, 1e-14);
  EXPECT_NEAR((K * Vector8::Ones()).cwiseAbs().maxCoeff(), 0, 1e-14);
}

// u = x y z on [0, 1]^3: int |grad u|^2 = 3 (1/3)^2.
TEST(Trilinear, StiffnessOfTheProductOfAllIndices) {
  const CellMatrix K = cell_matrix(full_moments(), CellMetric(Eigen::Matrix3d::Identity()), 0, 1);
  const Vector8 u = at_corners([](const Eigen::Vector3d& p) { return p.prod(); });
  EXPECT_NEAR(u.dot(K * u), 1.0 / 3, 1e-15);
}

TEST(Trilinear, IsTheWeightedSumOfMassAndStiffness) {
  const Moments part = box_moments(kLower, kUpper);
  const CellMetric metric(sheared());
  const CellMatrix expected =
      2 * metric.volume * cell_mass(part) + 3 * cell_matrix(part, metric, 0, 1);
  EXPECT_LT((cell_matrix(part, metric, 2, 3) - expected).cwiseAbs().maxCoeff(), 1e-14);
  const Eigen::SelfAdjointEigenSolver<CellMatrix> solver(expected);
  EXPECT_GT(solver.eigenvalues().minCoeff(), 0);
}

}  // namespace
}  // namespace surf::fem
