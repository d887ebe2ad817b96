#include "libsurf/energy/region_statistics.h"

#include "libsurf/base/error.h"
#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"
#include "tests/surf/energy/same_terms.h"

namespace surf::energy {
namespace {

constexpr StatisticsOptions kOptions{.quadrature_order = 2, .ray_spacing_mm = 0.05};
const ImageTotals kTotals{30, 44, 70};

IN_BOTH_DIMENSIONS(Statistics);

/// p = (|Omega|, int I, int I^2).
std::vector<Profile> moments() {
  return {[](double) {
            return std::array<double, 3>{1, 0, 0};
          },
          [](double I) {
            return std::array<double, 3>{I, 1, 0};
          },
          [](double I) {
            return std::array<double, 3>{I * I, 2 * I, 2};
          }};
}

/// Q - S^2 / V, and its derivatives.
StatisticsValue deviation(double V, double S, double Q) {
  StatisticsValue out;
  const double mean = S / V;
  out.value = Q - S * mean;
  out.gradient = Eigen::Vector3d(mean * mean, -2 * mean, 1);
  out.hessian = Eigen::Matrix3d::Zero();
  out.hessian(0, 0) = -2 * mean * mean / V;
  out.hessian(1, 1) = -2 / V;
  out.hessian(0, 1) = out.hessian(1, 0) = 2 * mean / V;
  return out;
}

template <int Dim>
void expect_equal(ShapeEnergy<Dim>& a, ShapeEnergy<Dim>& b) {
  const auto shape = test::smooth_geometry<Dim>(1, 3);
  const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const auto kappa = fem::curvature<Dim>(shape, A);
  test::expect_same_terms<Dim>(a, b, shape, kappa, {.value = 1e-11, .first = 1e-12, .beta = 1e-11});
  SecondDerivative<Dim> a2(shape), b2(shape);
  a.differentiate_twice(kappa, 1, a2), b.differentiate_twice(kappa, 1, b2);
  const Eigen::VectorXd W = test::smooth_function<Dim>(shape.points(), 1);
  EXPECT_LT((a2.times(shape, A, W) - b2.times(shape, A, W)).cwiseAbs().maxCoeff(), 1e-11);
  const auto moved = shape.moved_to(1.01 * shape.points());
  EXPECT_NEAR(a.try_move(moved), b.try_move(moved), 1e-5);  // one sums swept squares, one does not
  Eigen::VectorXd inner = Eigen::VectorXd::Zero(1), expected = inner;
  a.add_density(Points<Dim>::Zero(1, Dim), 2, inner);
  b.add_density(Points<Dim>::Zero(1, Dim), 2, expected);
  EXPECT_NEAR(inner[0], expected[0], 1e-11);
}

TYPED_TEST(Statistics, WithTheDeviationsOfBothSidesIsChanVese) {
  constexpr int Dim = TypeParam::value;
  const auto I = std::make_shared<const test::WaveField<Dim>>(1);
  StatisticsModel model;
  model.w = moments();
  model.Phi = [](const Eigen::VectorXd& p) {
    StatisticsValue out = deviation(p[0], p[1], p[2]);
    const StatisticsValue outside = deviation(kTotals.content - p[0], kTotals.intensity - p[1],
                                              kTotals.intensity_squared - p[2]);
    out.value += outside.value;
    out.gradient -= outside.gradient;
    out.hessian += outside.hessian;
    return out;
  };
  RegionStatistics<Dim> statistics("chan-vese", I, model, kOptions);
  ChanVese<Dim> expected(I, kTotals, {.ray_spacing_mm = kOptions.ray_spacing_mm});
  expect_equal<Dim>(statistics, expected);
}

TYPED_TEST(Statistics, OfTheInnerVarianceAgreesWithTheDomainFunctional) {
  constexpr int Dim = TypeParam::value;
  const auto I = std::make_shared<const test::WaveField<Dim>>(1);
  StatisticsModel model;
  model.w = moments();
  model.Phi = [](const Eigen::VectorXd& p) { return deviation(p[0], p[1], p[2]); };
  RegionStatistics<Dim> statistics("inner variance", I, model, kOptions);
  DomainFunctional<Dim> expected(std::make_shared<const test::InnerVariance<Dim>>(I),
                                 {.ray_spacing_mm = kOptions.ray_spacing_mm});
  expect_equal<Dim>(statistics, expected);
}

TEST(RegionCompetition, NeedsAnImageThatVaries) {
  EXPECT_THROW(region_competition({.content = 2, .intensity = 6, .intensity_squared = 18}),
               UsageError);
}

TEST(RegionCompetition, HasTheDerivativesOfItsValue) {
  const auto model = region_competition(kTotals);
  const Eigen::Vector3d p(4, 1.5, 6);  // content, first and second moment of z
  const auto at = model.Phi(p);
  constexpr double kStep = 1e-5, kTolerance = 1e-8;
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXd plus = p, minus = p;
    plus[k] += kStep;
    minus[k] -= kStep;
    const auto ahead = model.Phi(plus), behind = model.Phi(minus);
    EXPECT_NEAR(at.gradient[k], (ahead.value - behind.value) / (2 * kStep), kTolerance) << k;
    const Eigen::VectorXd row = (ahead.gradient - behind.gradient) / (2 * kStep);
    EXPECT_LT((at.hessian.col(k) - row).cwiseAbs().maxCoeff(), kTolerance) << k;
  }
}

TYPED_TEST(Statistics, OfRegionCompetitionDoNotDependOnTheUnitOfIntensities) {
  constexpr int Dim = TypeParam::value;
  const auto I = std::make_shared<const test::WaveField<Dim>>(1);
  constexpr double kFactor = 1000, kOffset = -400;
  const auto scaled = mapped_field<Dim>(I, [](double v) {
    return std::array<double, 3>{kFactor * v + kOffset, kFactor, 0};
  });
  const ImageTotals totals{kTotals.content, kFactor * kTotals.intensity + kOffset * kTotals.content,
                           kFactor * kFactor * kTotals.intensity_squared +
                               2 * kFactor * kOffset * kTotals.intensity +
                               kOffset * kOffset * kTotals.content};
  RegionStatistics<Dim> J("", I, region_competition(kTotals), kOptions);
  RegionStatistics<Dim> other("", scaled, region_competition(totals), kOptions);
  const auto arrays = test::random_smooth_shape<Dim>(1, 3);
  J.reset({arrays.X, arrays.T}), other.reset({arrays.X, arrays.T});
  EXPECT_NEAR(J.value(), other.value(), 1e-9 * std::abs(J.value()));
}

}  // namespace
}  // namespace surf::energy
