// Newton's method, L-BFGS and flows that keep the content, each against a known minimum.
#include "libsurf/base/error.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/flow/evolution.h"
#include "tests/surf/flow/plain_shape.h"
#include "tests/surf/flow/stepping.h"

namespace surf::flow {
namespace {

using test::PlainShape;
using test::start;
using test::valley_energy;

IN_BOTH_DIMENSIONS(Methods);

// Methods take different ways to a minimum among normal displacements: vertices end at different
// places of it, and the discrete J differs by a share of the discretisation's error.
constexpr double kDrift = 1e-4;

template <int Dim>
FlowSummary descend(PlainShape<Dim>& shape, Method method) {
  auto J = valley_energy<Dim>();
  FlowOptions options;
  options.method = method;
  options.rel_tol = 1e-12;
  options.energy_tol = 0;
  options.max_steps = 200;
  shape.longest = 0.2;
  return evolve<Dim>(shape, J, options);
}

template <int Dim>
test::Arrays<Dim> ellipsoid(int level) {
  auto arrays = test::unit_sphere<Dim>(level);
  arrays.X.col(0) *= 1.4;
  arrays.X.col(1) *= 0.8;
  return arrays;
}

/// 1 on the sphere as it is meshed, above it on all others.
template <int Dim>
double roundness(const fem::Geometry<Dim>& shape, int level) {
  const auto arrays = test::unit_sphere<Dim>(level);
  const fem::Geometry<Dim> sphere(arrays.X, arrays.T);
  return shape.measure() / std::pow(shape.radius(), Dim - 1) /
         (sphere.measure() / std::pow(sphere.radius(), Dim - 1));
}

TYPED_TEST(Methods, ByNewtonTakeAFewStepsToTheMinimumOfTheH1Flow) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> by_newton(start<Dim>()), by_h1(start<Dim>());
  const FlowSummary newton = descend(by_newton, Method::kNewton);
  const FlowSummary h1 = descend(by_h1, Method::kGradientFlow);
  EXPECT_EQ(newton.termination, Termination::kConverged) << newton.message;
  EXPECT_LT(newton.steps.size(), Dim == 2 ? 8u : 12u);
  EXPECT_LT(newton.steps.size(), h1.steps.size());
  EXPECT_NEAR(newton.final_energy, h1.final_energy, kDrift * h1.final_energy);
  test::expect_descent(newton, 0.2);
  for (const StepRecord& step : newton.steps) EXPECT_LT(step.shape_derivative, 0);
}

/// An energy that falls by a seventh of what its derivatives promise, so that the trust region
/// shrinks with every step.
template <int Dim>
class Reluctant : public energy::BoundaryIntegral<Dim> {
 public:
  using Base = energy::BoundaryIntegral<Dim>;
  Reluctant() : Base(std::make_shared<const test::SphericalValley<Dim>>()) {}

  void reset(const fem::Geometry<Dim>& shape) override {
    Base::reset(shape);
    value_ = Base::value();
  }
  double value() const override { return value_; }
  double try_move(const fem::Geometry<Dim>& moved) override {
    const double before = Base::value();
    return tried_ = value_ + (Base::try_move(moved) - before) / 7;
  }
  void accept() override {
    Base::accept();
    value_ = tried_;
  }

 private:
  double value_ = 0, tried_ = 0;
};

// dJ of a step falls with the step's length; that is no minimum.
TYPED_TEST(Methods, ByNewtonDoNotTakeASmallTrustRegionForAMinimum) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(start<Dim>());
  shape.longest = 0.02;  // all steps together are too short to reach the valley
  Reluctant<Dim> J;
  FlowOptions options;
  options.method = Method::kNewton;
  options.rel_tol = 1e-3;
  options.energy_tol = 0;
  options.max_steps = 25;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  EXPECT_NE(summary.termination, Termination::kConverged) << summary.message;
}

TYPED_TEST(Methods, ByLbfgsEndAtTheMinimumOfNewtonsMethod) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> by_newton(start<Dim>()), by_lbfgs(start<Dim>());
  const FlowSummary newton = descend(by_newton, Method::kNewton);
  const FlowSummary lbfgs = descend(by_lbfgs, Method::kLbfgs);
  test::expect_descent(lbfgs, 0.2);
  EXPECT_NEAR(lbfgs.final_energy, newton.final_energy, kDrift * newton.final_energy);
  EXPECT_NEAR(by_lbfgs.geometry().enclosed(), by_newton.geometry().enclosed(),
              2e-3 * by_newton.geometry().enclosed());
}

TYPED_TEST(Methods, BySurfaceDiffusionTakeAnEllipsoidToABallAndKeepItsContentToRounding) {
  constexpr int Dim = TypeParam::value;
  constexpr int kLevel = Dim == 2 ? 3 : 2;
  PlainShape<Dim> shape(ellipsoid<Dim>(kLevel));
  const double content = shape.geometry().enclosed();
  auto J = test::area_energy<Dim>();
  FlowOptions options;
  options.velocity = {.product = ScalarProduct::kHMinus1, .scheme = Scheme::kSemiImplicit};
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  for (const StepRecord& step : summary.steps)
    ASSERT_NEAR(step.enclosed, content, 1e-13 * content) << step.k;
  EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
  EXPECT_LT(roundness<Dim>(shape.geometry(), kLevel), 1.005);
  EXPECT_LT(summary.steps.size(), 20u);
}

// The explicit scheme needs steps of h^4.
TYPED_TEST(Methods, ByExplicitSurfaceDiffusionDescendSlowlyAndKeepTheContentToRounding) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(ellipsoid<Dim>(2));
  const double content = shape.geometry().enclosed();
  auto J = test::area_energy<Dim>();
  FlowOptions options;
  options.velocity = {.product = ScalarProduct::kHMinus1};
  options.max_steps = 30;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  EXPECT_EQ(summary.steps.size(), 30u) << summary.message;
  double before = summary.initial_energy;
  for (const StepRecord& step : summary.steps) {
    ASSERT_NEAR(step.enclosed, content, 1e-13 * content) << step.k;
    EXPECT_LT(step.energy, before);
    before = step.energy;
  }
}

// The area has its minimum at the ball, where dJ + lambda dC = 0: lambda = -kappa.
TYPED_TEST(Methods, ThatKeepTheContentTakeAnEllipsoidToABallWithItsCurvatureAsMultiplier) {
  constexpr int Dim = TypeParam::value;
  constexpr int kLevel = Dim == 2 ? 4 : 3;
  const auto run = [&](FlowOptions options) {
    PlainShape<Dim> shape(ellipsoid<Dim>(kLevel));
    const double content = shape.geometry().enclosed();
    auto J = test::area_energy<Dim>();
    options.keep_content = true;
    options.max_steps = 300;
    options.energy_tol = 1e-5;
    const FlowSummary summary = evolve<Dim>(shape, J, options);
    for (const StepRecord& step : summary.steps)
      ASSERT_NEAR(step.enclosed, content, 1e-13 * content) << step.k;
    EXPECT_LT(roundness<Dim>(shape.geometry(), kLevel), 1.005) << summary.message;
    const double kappa = (Dim - 1) / shape.geometry().radius();
    EXPECT_NEAR(summary.steps.back().multiplier, -kappa, 0.03 * kappa);
  };
  FlowOptions options;
  run(options);
  options.velocity = {.product = ScalarProduct::kL2, .scheme = Scheme::kSemiImplicit};
  run(options);
  options = {};
  options.method = Method::kNewton;
  run(options);
}

energy::CurvatureIntegral<3> willmore_energy() {
  return energy::CurvatureIntegral<3>(
      energy::squared_curvature<3>(energy::constant_field<3>(1), 0));
}

std::vector<FlowOptions> willmore_flows() {
  std::vector<FlowOptions> out(3);
  out[1].velocity.scheme = Scheme::kSemiImplicit;
  out[2].method = Method::kNewton;
  return out;
}

// J = 1/2 int kappa^2 is 8 pi on every sphere; on a mesh of 1,026 vertices 0.8 % less.
TEST(WillmoreFlow, TakesABumpyBallToTheEnergyOfTheSphere) {
  for (const FlowOptions& options : willmore_flows()) {
    PlainShape<3> shape(test::random_smooth_shape<3>(3, 4));
    auto J = willmore_energy();
    const FlowSummary summary = evolve<3>(shape, J, options);
    EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
    EXPECT_GT(summary.initial_energy, 1.015 * 8 * std::numbers::pi);
    EXPECT_NEAR(summary.final_energy, 8 * std::numbers::pi, 0.01 * 8 * std::numbers::pi);
    EXPECT_LT(summary.steps.size(), 20u);
  }
}

TEST(WillmoreFlow, TakesATorusToTheRatioOfClifford) {
  for (const FlowOptions& options : {willmore_flows()[0], willmore_flows()[2]}) {
    PlainShape<3> shape(test::torus(1, 0.4, 40, 25));
    auto J = willmore_energy();
    FlowOptions short_run = options;
    short_run.max_steps = 8;  // on a mesh that stays the discrete J falls on as it degenerates
    evolve<3>(shape, J, short_run);
    const auto end = shape.geometry();
    const double r = 2 * end.enclosed() / end.measure();
    const double R = end.measure() / (4 * std::numbers::pi * std::numbers::pi * r);
    EXPECT_NEAR(R / r, std::sqrt(2.0), 0.02);
    EXPECT_NEAR(J.value(), 4 * std::numbers::pi * std::numbers::pi, 1.5);
  }
}

TYPED_TEST(Methods, ThatKeepAGivenContentBeginThere) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(ellipsoid<Dim>(3));
  const double content = 2.5 * shape.geometry().enclosed();
  auto J = test::area_energy<Dim>();
  FlowOptions options;
  options.content = content;
  options.max_steps = 3;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  ASSERT_EQ(summary.steps.size(), 3u);
  for (const StepRecord& step : summary.steps) EXPECT_NEAR(step.enclosed, content, 1e-13 * content);
  EXPECT_LT(summary.final_energy, summary.initial_energy);
}

TYPED_TEST(Methods, SayWhenTheContentCannotBeReached) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(ellipsoid<Dim>(2));
  shape.is_frozen = true;
  auto J = test::area_energy<Dim>();
  for (const double content : {100.0, 1.01 * shape.geometry().enclosed()}) {  // one move away
    FlowOptions options;
    options.content = content;
    const FlowSummary summary = evolve<Dim>(shape, J, options);
    EXPECT_EQ(summary.termination, Termination::kObstacle);
    EXPECT_NE(summary.message.find("cannot be reached"), std::string::npos) << summary.message;
  }
}

TEST(FlowOptions, NameWhatDoesNotGoTogether) {
  FlowOptions options;
  options.method = Method::kLbfgs;
  options.keep_content = true;
  EXPECT_EQ(options.error(),
            "FlowOptions::keep_content: L-BFGS cannot keep the content; use a gradient flow or "
            "Newton's method");
  options.keep_content = false;
  options.velocity.scheme = Scheme::kSemiImplicit;
  EXPECT_EQ(options.error(), "FlowOptions::velocity.scheme: only gradient flows are semi-implicit");
  options = {};
  options.method = Method::kNewton;
  options.step.bound = StepBound::kVertex;
  EXPECT_EQ(options.error(),
            "FlowOptions::step.bound: only gradient flows bound each vertex for itself");
  options = {};
  options.content = -1;
  EXPECT_EQ(options.error(), "FlowOptions::content = -1 violates > 0");
}

}  // namespace
}  // namespace surf::flow
