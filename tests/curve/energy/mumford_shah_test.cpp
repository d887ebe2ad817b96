#include "libcurve/energy/mumford_shah.h"

#include <cmath>
#include <numbers>

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "libsurf/base/random.h"
#include "libsurf/fem/stiffness.h"
#include "tests/curve/analytic_fields.h"
#include "tests/curve/curves.h"
#include "tests/curve/mumford_shah_options.h"
#include "tests/surf/energy/energies.h"
#include "tests/surf/flow/plain_shape.h"

namespace surf::curve {
namespace {

MumfordShahOptions options(double h) {
  MumfordShahOptions out = options_on_square(h);
  out.contrast = 1.3;
  return out;
}

/// r(t) = 1 + sum of a few waves with random amplitudes, n elements.
Segments random_blob(int n, std::uint64_t seed) {
  const auto amplitude = [&](std::uint64_t k) { return 0.1 * (2 * uniform_random(seed, k) - 1); };
  Segments out{Points<2>(n, 2), Elements<2>(n, 2)};
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    double r = 0.9;
    for (int k = 2; k <= 5; ++k)
      r += amplitude(2 * k) * std::cos(k * t) + amplitude(2 * k + 1) * std::sin(k * t);
    out.points.row(i) << r * std::cos(t), r * std::sin(t);
    out.elements.row(i) << i, (i + 1) % n;
  }
  return out;
}

fem::Geometry<2> geometry(const Segments& curves) { return {curves.points, curves.elements}; }

Points<2> derivative(const MumfordShah& J, const fem::Geometry<2>& shape) {
  energy::ShapeTerms<2> terms(shape);
  J.differentiate(fem::Curvature{Eigen::VectorXd::Zero(shape.n_vertices()),
                                 Eigen::VectorXd::Zero(shape.n_vertices())},
                  1, terms);
  return terms.derivative;
}

TEST(MumfordShah, DerivativeIsThatOfTheDiscreteEnergy) {
  constexpr double kTolerance = 1e-7;  // of central differences: steps squared, rounding / step
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const Segments curves = random_blob(40, seed);
    const fem::Geometry<2> shape = geometry(curves);
    MumfordShah J(bright_waves(), options(0.05));
    J.reset(shape);
    const Points<2> exact = derivative(J, shape);
    Points<2> V(shape.n_vertices(), 2);
    for (Eigen::Index i = 0; i < V.size(); ++i) V.data()[i] = 2 * uniform_random(seed + 9, i) - 1;
    const double dJ = exact.cwiseProduct(V).sum();
    constexpr double kStep = 3e-5;
    const double plus = J.try_move(shape.moved_to(curves.points + kStep * V));
    const double minus = J.try_move(shape.moved_to(curves.points - kStep * V));
    EXPECT_NEAR((plus - minus) / (2 * kStep), dJ, kTolerance * exact.norm() * V.norm()) << seed;
  }
}

// Theorem 2.2.10: the normal part of the derivative is <G, phi_i>.
TEST(MumfordShah, DerivativeConvergesToTheBoundaryForm) {
  std::array<double, 2> errors;
  for (int level = 0; level < 2; ++level) {
    const int n = 80 << level;
    const fem::Geometry<2> shape = geometry(random_blob(n, 7));
    MumfordShah J(bright_waves(), options(3.0 / n));
    J.reset(shape);
    const auto A = fem::stiffness<2>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
    const Eigen::VectorXd G = J.shape_gradient(J.traces(), fem::mean_curvature<2>(shape, A));
    const Eigen::VectorXd normal_part =
        derivative(J, shape).cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const Eigen::VectorXd weak = G.cwiseProduct(shape.lumped_mass());
    errors[level] = (normal_part - weak).cwiseAbs().sum() / weak.cwiseAbs().sum();
  }
  EXPECT_LT(errors[0], 0.05);
  EXPECT_LT(errors[1], 0.55 * errors[0]);  // first order at least
}

double second_error(int level) {
  return test::second_derivative_error<2>(level, [](const fem::Geometry<2>& shape, unsigned) {
    return std::make_unique<MumfordShah>(bright_waves(),
                                         options(shape.measure() / double(shape.n_elements())));
  });
}

// Theorem 2.2.11, u' included: without the operator of u' the error is far above the bound.
TEST(MumfordShah, SecondDerivativeConvergesToTheDifferenceQuotient) {
  const double coarse = second_error(2), fine = second_error(3);
  EXPECT_LT(fine, 0.02);
  EXPECT_LT(fine, 0.5 * coarse);
}

TEST(MumfordShah, SecondDerivativeIsProportionalToItsWeight) {
  const auto smooth = test::smooth_shape<2>(4, 2);
  const fem::Geometry<2> shape(smooth.X, smooth.T);
  MumfordShah J(bright_waves(), options(0.05));
  J.reset(shape);
  const auto A = fem::stiffness<2>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  energy::SecondDerivative<2> once(shape), thrice(shape);
  J.differentiate_twice(fem::curvature<2>(shape, A), 1, once);
  J.differentiate_twice(fem::curvature<2>(shape, A), 3, thrice);
  const Eigen::VectorXd W = test::smooth_function<2>(smooth.X, 5);
  const Eigen::VectorXd product = once.times(shape, A, W);
  EXPECT_LT((thrice.times(shape, A, W) - 3 * product).norm(), 1e-9 * product.norm());
}

/// A disc with a soft edge under a wave that u cannot follow.
std::shared_ptr<const Field<2>> waves_over_a_disc() {
  constexpr double kRadius = 0.9, kWidth = 0.15;
  const auto step = [](double r) { return std::tanh((kRadius - r) / kWidth); };
  return std::make_shared<FormulaField>(
      [=](const Vector<2>& x) {
        return 0.5 * (1 + step(x.norm())) + 0.4 * std::sin(2 * x[0] + x[1]);
      },
      [=](const Vector<2>& x) -> Vector<2> {
        const double t = step(x.norm()), c = 0.4 * std::cos(2 * x[0] + x[1]);
        return -(1 - t * t) / (2 * kWidth * x.norm()) * x + Vector<2>(2 * c, c);
      });
}

// On a mesh that is never mended: 8 and 15, 7 and 14 steps to |dJ| of 1e-12 of the first one.
TEST(MumfordShah, NewtonConvergesFasterThanTheH1Flow) {
  for (const double mu : {0.2, 1.0}) {
    MumfordShahOptions model = options_on_square(0.05);
    model.mu = mu;
    model.gamma = 0.01;
    model.max_size_mm = 0.2;
    const Segments curve = circle({0.05, 0.02}, 1, 0.1);
    const auto descend = [&](flow::Method method) {
      MumfordShah J(waves_over_a_disc(), model);
      test::PlainShape<2> shape({curve.points, curve.elements});
      shape.longest = 0.2;
      flow::FlowOptions how;
      how.method = method;
      how.rel_tol = 1e-12;
      how.energy_tol = 0;
      how.max_steps = 60;
      return flow::evolve<2>(shape, J, how);
    };
    const flow::FlowSummary newton = descend(flow::Method::kNewton),
                            h1 = descend(flow::Method::kGradientFlow);
    EXPECT_EQ(newton.termination, flow::Termination::kConverged) << newton.message;
    EXPECT_EQ(h1.termination, flow::Termination::kConverged) << h1.message;
    EXPECT_LE(newton.steps.size(), 9u) << mu;
    EXPECT_GE(h1.steps.size(), 12u) << mu;
    EXPECT_NEAR(newton.final_energy, h1.final_energy, 1e-5 * h1.final_energy);
  }
}

TEST(MumfordShah, EnergyOfATrialIsThatOfANewMesh) {
  const Segments curves = circle({0.1, 0}, 0.8, 0.05);
  const fem::Geometry<2> shape = geometry(curves);
  MumfordShah J(bright_waves(), options(0.05));
  J.reset(shape);
  const double before = J.value();
  const fem::Geometry<2> moved = shape.moved_to(curves.points * 1.05);
  const double tried = J.try_move(moved);
  J.accept();
  EXPECT_EQ(J.value(), tried);
  J.reset(moved);
  EXPECT_NEAR(J.value(), tried, 0.02 * std::abs(tried - before));
}

// Else steps that gain are taken for ones that lose, and a flow for one at rest.
TEST(MumfordShah, EnergyIsContinuousOverSurgery) {
  const fem::Geometry<2> shape = geometry(circle({0.1, 0}, 0.8, 0.05)),
                         other = geometry(circle({0.1, 0}, 0.7, 0.05));
  MumfordShah J(bright_waves(), options(0.05)), anew(bright_waves(), options(0.05));
  J.reset(shape);
  const double before = J.value();
  J.rebuild(other);
  anew.reset(shape);  // so that both have the same sizes of triangles
  anew.reset(other);
  EXPECT_GT(std::abs(anew.value() - before), 0.01 * std::abs(before));
  EXPECT_EQ(J.value(), before);
  EXPECT_NEAR(J.value() + J.drift(), anew.value(), 1e-6 * std::abs(before));
  const fem::Geometry<2> moved = other.moved_to(other.points() * 1.02);
  EXPECT_NEAR(J.try_move(moved) - J.value(), anew.try_move(moved) - anew.value(),
              1e-6 * std::abs(before));
  J.reset(other);
  EXPECT_EQ(J.drift(), 0);
}

TEST(MumfordShah, EnergyDoesNotDependOnTheUnitOfIntensity) {
  class Mapped : public Field<2> {
   public:
    void sample(const Points<2>& x, Derivatives order, Samples<2>& out) const override {
      bright_waves()->sample(x, order, out);
      out.value = 300 * out.value.array() + 1000;
      out.gradient *= 300;
    }
  };
  const fem::Geometry<2> shape = geometry(random_blob(40, 3));
  MumfordShahOptions mapped = options(0.05);
  mapped.contrast *= 300;
  MumfordShah J(bright_waves(), options(0.05)), K(std::make_shared<Mapped>(), mapped);
  J.reset(shape);
  K.reset(shape);
  constexpr double kTolerance = 1e-9;  // of the solver
  EXPECT_NEAR(K.value(), J.value(), kTolerance * J.value());
  EXPECT_LT((derivative(K, shape) - derivative(J, shape)).norm(),
            1e-6 * derivative(J, shape).norm());
}

/// 1 in the disc of radius 0.8 and 0 outside, sharp.
std::shared_ptr<const Field<2>> disc() {
  return std::make_shared<FormulaField>([](const Vector<2>& x) { return x.norm() < 0.8 ? 1 : 0; },
                                        [](const Vector<2>&) { return Vector<2>::Zero(); });
}

TEST(MumfordShah, DenoisedImageIsConstantOnBothSidesOfAConstantObject) {
  MumfordShah J(disc(), options(0.02));
  J.reset(geometry(circle({0, 0}, 0.8, 0.02)));
  Points<2> x(4, 2);
  x << 0, 0, 0.7, 0.2, 0.9, 0, 1.9, -1.9;
  const Eigen::VectorXd u = J.denoised(x);
  constexpr double kTolerance = 1e-3;  // the polygon in place of the circle
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(u[i], i < 2 ? 1 : 0, kTolerance) << i;
}

TEST(MumfordShah, CurveInsideTheObjectGrowsAndOneOutsideShrinks) {
  for (const double r : {0.6, 1.1}) {
    const fem::Geometry<2> shape = geometry(circle({0, 0}, r, 0.05));
    MumfordShah J(disc(), options(0.02));
    J.reset(shape);
    const double dJ = derivative(J, shape).cwiseProduct(shape.nodal_normals()).sum();
    EXPECT_EQ(dJ < 0, r < 0.8) << r;
  }
}

TEST(MumfordShah, HoleIsWorthOpeningWhereTheBackgroundShows) {
  MumfordShah J(disc(), options(0.02));
  J.reset(geometry(circle({0, 0}, 1.3, 0.05)));
  Points<2> x(2, 2);
  x << 0, 0, 1.2, 0;
  Eigen::VectorXd density = Eigen::VectorXd::Zero(2);
  J.add_density(x, 1, density);
  EXPECT_LT(density[0], 0);
  EXPECT_GT(density[1], 0);
}

TEST(MumfordShah, TrialWhoseCurvesCrossHasTheEnergyOfTheirUnion) {
  const Segments two = joined({circle({-0.7, 0}, 0.6, 0.05), circle({0.7, 0}, 0.6, 0.05)});
  const fem::Geometry<2> shape = geometry(two);
  MumfordShah J(bright_waves(), options(0.05));
  J.reset(shape);
  Points<2> to = two.points;
  for (Eigen::Index i = 0; i < to.rows(); ++i) to(i, 0) += to(i, 0) < 0 ? 0.2 : -0.2;
  const double J_crossed = J.try_move(shape.moved_to(to));
  J.accept();
  double length = 0;
  for (const TraceEdge& edge : J.solution().mesh().trace)
    length +=
        (J.solution().mesh().points.row(edge.end) - J.solution().mesh().points.row(edge.start))
            .norm();
  // The arcs inside the other circle are gone: those with cos t > 5/6.
  const double arc = 2 * std::acos(0.5 / 0.6) * 0.6;
  EXPECT_NEAR(length, 2 * (2 * std::numbers::pi * 0.6 - arc), 0.05);
  EXPECT_TRUE(std::isfinite(J_crossed));
  // The mesh is that of the union: there is no derivative by the vertices of the two circles.
  EXPECT_THROW(derivative(J, shape.moved_to(to)), InvalidMesh);
  EXPECT_THROW(J.traces(), InvalidMesh);
  EXPECT_THROW(J.reset(shape.moved_to(to)), InvalidMesh);
}

TEST(MumfordShah, CurvesOutsideTheBoxAreRefused) {
  MumfordShah J(bright_waves(), options(0.05));
  EXPECT_THROW(J.reset(geometry(circle({1.5, 0}, 0.8, 0.05))), InvalidMesh);
}

TEST(MumfordShah, OptionsAreChecked) {
  MumfordShahOptions bad = options(0.05);
  bad.mu = 0;
  EXPECT_THROW(MumfordShah(bright_waves(), bad), UsageError);
  bad = options(0.05);
  bad.contrast = -1;
  EXPECT_NE(bad.error().find("MumfordShahOptions::contrast = -1"), std::string::npos);
}

// Alg. 8: until the mean square of the interpolation error falls below the tolerance.
TEST(MumfordShah, DataAdaptivityRefinesUntilTheImageIsResolved) {
  MumfordShahOptions coarse = options(0.02);
  coarse.max_size_mm = 0.6;
  MumfordShahOptions fine = coarse;
  fine.data_tolerance = 5e-5;
  const fem::Geometry<2> shape = geometry(circle({0.2, 0}, 0.8, 0.2));
  const auto mean_error = [&](const MumfordShahOptions& o) {
    MumfordShah J(bright_waves(), o);
    for (int k = 0; k < 5; ++k) J.reset(shape);  // bounds on sizes stay
    return J.solution().integrals().errors.sum() / 16;
  };
  EXPECT_GT(mean_error(coarse), 3 * fine.data_tolerance);
  EXPECT_LE(mean_error(fine), fine.data_tolerance);
}

}  // namespace
}  // namespace surf::curve
