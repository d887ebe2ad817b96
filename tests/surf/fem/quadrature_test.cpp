#include "libsurf/fem/quadrature.h"

#include <stdexcept>

#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

IN_BOTH_DIMENSIONS(QuadratureRule);

/// Integral of prod lambda_i^a_i over a simplex of Dim vertices and measure 1:
/// (Dim - 1)! prod a_i! / (Dim - 1 + sum a_i)!.
template <int Dim>
double exact_integral(const std::array<int, Dim>& powers) {
  double result = std::tgamma(Dim);
  int degree = 0;
  for (const int power : powers) {
    result *= std::tgamma(power + 1);
    degree += power;
  }
  return result / std::tgamma(Dim + degree);
}

/// Every tuple of powers whose sum is `degree`.
template <int Dim>
std::vector<std::array<int, Dim>> monomials(int degree) {
  std::vector<std::array<int, Dim>> all;
  for (int a = 0; a <= degree; ++a)
    for (int b = 0; b <= degree - a; ++b) {
      if constexpr (Dim == 2) {
        if (a + b == degree) all.push_back({a, b});
      } else {
        all.push_back({a, b, degree - a - b});
      }
    }
  return all;
}

TYPED_TEST(QuadratureRule, IsExactForEveryMonomialUpToItsOrder) {
  constexpr int Dim = TypeParam::value;
  constexpr double kTolerance = 1e-15;  // the integrals are at most 1; a few roundings
  for (int order = 1; order <= 5; ++order) {
    const auto& rule = quadrature<Dim>(order);
    for (int degree = 0; degree <= order; ++degree)
      for (const auto& powers : monomials<Dim>(degree)) {
        double sum = 0;
        for (Eigen::Index q = 0; q < rule.size(); ++q) {
          double value = rule.weights[q];
          for (int i = 0; i < Dim; ++i) value *= std::pow(rule.points(q, i), powers[i]);
          sum += value;
        }
        EXPECT_NEAR(sum, exact_integral<Dim>(powers), kTolerance)
            << "order " << order << ", degree " << degree;
      }
  }
}

TYPED_TEST(QuadratureRule, HasPositiveWeightsAndPointsInsideTheElement) {
  constexpr int Dim = TypeParam::value;
  for (int order = 1; order <= 5; ++order) {
    const auto& rule = quadrature<Dim>(order);
    EXPECT_GT(rule.weights.minCoeff(), 0) << order;
    EXPECT_GT(rule.points.minCoeff(), 0) << order;
    for (Eigen::Index q = 0; q < rule.size(); ++q)
      EXPECT_NEAR(rule.points.row(q).sum(), 1, 1e-15) << order;
  }
}

TYPED_TEST(QuadratureRule, OfAnOrderThatDoesNotExistIsRefused) {
  constexpr int Dim = TypeParam::value;
  EXPECT_THROW(quadrature<Dim>(0), std::out_of_range);
  EXPECT_THROW(quadrature<Dim>(6), std::out_of_range);
}

}  // namespace
}  // namespace surf::fem
