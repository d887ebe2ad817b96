// Mean curvature flow, the L2 gradient flow of the length or area, has a known solution: spheres
// shrink with r(t) = sqrt(r_0^2 - 2 (Dim - 1) t).
#include <fmt/format.h>

#include "libsurf/energy/domain_integral.h"
#include "tests/surf/flow/stepping.h"

namespace surf::flow {
namespace {

VelocityOptions l2(Scheme scheme) {
  return {.product = ScalarProduct::kL2, .scheme = scheme, .solver_tolerance = 1e-12};
}

IN_BOTH_DIMENSIONS(MeanCurvatureFlow);

constexpr double kEnd = 0.1;

/// Radius (of the ball of equal volume) at time kEnd, less the exact one; r_0 likewise.
template <int Dim>
double radius_error(Scheme scheme, int level, int n_steps) {
  const auto arrays = test::unit_sphere<Dim>(level);
  fem::Geometry<Dim> shape(arrays.X, arrays.T);
  const double r0 = shape.radius();
  auto J = test::area_energy<Dim>();
  shape = test::flowed<Dim>(shape, J, l2(scheme), kEnd / n_steps, n_steps);
  return shape.radius() - std::sqrt(r0 * r0 - 2 * (Dim - 1) * kEnd);
}

TYPED_TEST(MeanCurvatureFlow, OfASphereConvergesToTheExactRadiusWithTauAndTheSquareOfTheEdge) {
  constexpr int Dim = TypeParam::value;
  constexpr int kCoarsest = Dim - 1;
  for (const Scheme scheme : {Scheme::kExplicit, Scheme::kSemiImplicit}) {
    double before = 0;
    for (int finer = 0; finer < 3; ++finer) {  // edge halved, tau divided by 4
      const int n_steps = (Dim == 2 ? 8 : 16) << (2 * finer);
      const double error = std::abs(radius_error<Dim>(scheme, kCoarsest + finer, n_steps));
      fmt::print("{}-D {:<13} n = {:4}: error of r(t) {:.2e}\n", Dim,
                 scheme == Scheme::kExplicit ? "explicit" : "semi-implicit", n_steps, error);
      if (finer > 0) {
        EXPECT_NEAR(std::log2(before / error), 2, 0.35);
      }
      before = error;
    }
    EXPECT_LT(before, Dim == 2 ? 1e-3 : 3e-3);
  }
}

// The difference of both schemes and the error of each are first order in tau on a fixed mesh.
TYPED_TEST(MeanCurvatureFlow, SchemesAgreeToFirstOrderAsTheStepGoesToZero) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(3, Dim == 2 ? 3 : 2);
  const fem::Geometry<Dim> start(arrays.X, arrays.T);
  const auto difference = [&](int n_steps) {
    auto J = test::area_energy<Dim>();
    const double tau = 0.04 / n_steps;
    const auto a = test::flowed<Dim>(start, J, l2(Scheme::kExplicit), tau, n_steps);
    const auto b = test::flowed<Dim>(start, J, l2(Scheme::kSemiImplicit), tau, n_steps);
    return (a.points() - b.points()).rowwise().norm().maxCoeff();
  };
  const double coarse = difference(32), middle = difference(64), fine = difference(128);
  EXPECT_NEAR(std::log2(coarse / middle), 1, 0.15);
  EXPECT_NEAR(std::log2(middle / fine), 1, 0.1);
  EXPECT_LT(fine, 1e-3);
}

/// Both sides of (3.50) for g = 1 (m_g = 1) and lumped masses, step by step.
template <int Dim>
void expect_area_bound(double tau, unsigned seed) {
  const auto arrays = test::random_smooth_shape<Dim>(seed, Dim == 2 ? 4 : 3);
  fem::Geometry<Dim> shape(arrays.X, arrays.T);
  const auto f_field = std::make_shared<const test::WaveField<Dim>>(seed, /*offset=*/-0.8);
  const energy::DomainIntegralOptions domain{.quadrature_order = 2, .ray_spacing_mm = 0.05};
  energy::EnergySum<Dim> J;
  J.add(1, std::make_unique<energy::BoundaryIntegral<Dim>>(energy::constant_field<Dim>(1)));
  J.add(1, std::make_unique<energy::DomainIntegral<Dim>>(f_field, domain));
  energy::DomainIntegral<Dim> force(f_field, domain);
  double left = 0, right = shape.measure();
  for (int n = 0; n < 10; ++n) {
    const test::Direction<Dim> direction(shape, J, l2(Scheme::kSemiImplicit));
    const auto f_terms = test::Direction<Dim>::terms_of(shape, direction.A, force);
    const auto velocity = direction.system.solve(tau);
    const Eigen::VectorXd& m = shape.lumped_mass();
    const Eigen::VectorXd f =
        f_terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum().cwiseQuotient(m);
    const auto moved = test::stepped<Dim>(shape, velocity, tau);
    // kappa^(n+1) of (3.42), (3.43) at the new points, on the old surface.
    const Points<Dim> load = direction.A * moved.points();
    const Eigen::VectorXd kappa =
        load.cwiseProduct(shape.nodal_normals()).rowwise().sum().cwiseQuotient(m);
    EXPECT_LT((velocity.normal + kappa + f).cwiseAbs().maxCoeff(),  // (3.44): V = -kappa - f
              1e-7 * (1 + kappa.cwiseAbs().maxCoeff()));
    left += 0.5 * tau * kappa.cwiseAbs2().dot(m);
    right += 0.5 * tau * f.cwiseAbs2().dot(m);
    shape = moved;
    ASSERT_LE(shape.measure() + left, right * (1 + 1e-10))
        << "tau " << tau << ", seed " << seed << ", step " << n;
  }
}

TYPED_TEST(MeanCurvatureFlow, SemiImplicitL2SchemeKeepsTheAreaBoundAtAnyStep) {
  constexpr int Dim = TypeParam::value;
  for (const double tau : {1e-3, 1e-2, 0.1})
    for (unsigned seed = 1; seed <= 3; ++seed) expect_area_bound<Dim>(tau, seed);
}

// One step of any length: the area inequality needs no bound on tau.
TYPED_TEST(MeanCurvatureFlow, SemiImplicitL2StepWithoutForceNeverIncreasesTheArea) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5, 3);
  auto J = test::area_energy<Dim>();
  const test::Direction<Dim> direction(shape, J, l2(Scheme::kSemiImplicit));
  for (const double tau : {1e-3, 0.1, 10.0, 1000.0}) {
    const auto moved = test::stepped<Dim>(shape, direction.system.solve(tau), tau);
    EXPECT_LT(moved.measure(), shape.measure()) << tau;
  }
}

// The explicit scheme has no such bound: beyond tau ~ h^2 it blows up. That both differ shows that
// the tests above test the implicit term.
TYPED_TEST(MeanCurvatureFlow, ExplicitL2StepIncreasesTheAreaBeyondTheSquareOfTheEdge) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5, 3);
  auto J = test::area_energy<Dim>();
  const test::Direction<Dim> direction(shape, J, l2(Scheme::kExplicit));
  EXPECT_GT(test::stepped<Dim>(shape, direction.system.solve(0), 0.2).measure(), shape.measure());
}

}  // namespace
}  // namespace surf::flow
