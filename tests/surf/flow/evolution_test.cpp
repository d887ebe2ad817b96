#include "libsurf/flow/evolution.h"

#include "libsurf/base/error.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/energy/fields.h"
#include "tests/surf/flow/plain_shape.h"

namespace surf::flow {
namespace {

using test::PlainShape;
using test::start;
using test::valley_energy;

IN_BOTH_DIMENSIONS(Evolution);

/// From start() to the minimum in the valley.
template <int Dim>
FlowSummary descend(const FlowOptions& options) {
  PlainShape<Dim> shape(start<Dim>());
  auto J = valley_energy<Dim>();
  return evolve<Dim>(shape, J, options);
}

TYPED_TEST(Evolution, DescendsMonotonicallyToTheSameMinimumWithEveryProductSchemeAndRule) {
  constexpr int Dim = TypeParam::value;
  std::vector<double> minima;
  for (const ScalarProduct product : {ScalarProduct::kL2, ScalarProduct::kH1})
    for (const Scheme scheme : {Scheme::kExplicit, Scheme::kSemiImplicit})
      for (const StepRule rule : {StepRule::kBacktracking, StepRule::kLineSearch}) {
        PlainShape<Dim> shape(start<Dim>());
        auto J = valley_energy<Dim>();
        FlowOptions options;
        options.velocity = {.product = product, .scheme = scheme};
        options.step.rule = rule;
        options.max_steps = 2000;
        options.energy_tol = 1e-4;
        const FlowSummary summary = evolve<Dim>(shape, J, options);
        EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
        test::expect_descent(summary, 0.1);
        minima.push_back(summary.final_energy);
        EXPECT_NEAR(shape.geometry().radius(), 0.97, 0.05);
      }
  const auto [lowest, highest] = std::minmax_element(minima.begin(), minima.end());
  EXPECT_LT(*highest - *lowest, 0.05 * *lowest);
}

/// Grows by more than a step shrinks it.
template <int Dim>
struct SwellingShape : PlainShape<Dim> {
  using PlainShape<Dim>::PlainShape;
  bool mend() override {
    const fem::Geometry<Dim> now = this->geometry();
    this->move_to((1 + 1.5 * this->longest / now.radius()) * now.points());
    return true;
  }
};

TYPED_TEST(Evolution, IsNotConvergedWhereTheEnergyRises) {
  constexpr int Dim = TypeParam::value;
  SwellingShape<Dim> shape(start<Dim>());
  shape.longest = 0.02;
  auto J = valley_energy<Dim>();
  const FlowSummary summary = evolve<Dim>(shape, J, FlowOptions());
  EXPECT_EQ(summary.termination, Termination::kRising) << summary.message;
  EXPECT_GT(summary.final_energy, summary.initial_energy);
  EXPECT_EQ(summary.steps.size(), 41u);
}

TYPED_TEST(Evolution, RecordsTheShapeAfterEachStep) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(start<Dim>());
  auto J = valley_energy<Dim>();
  FlowOptions options;
  options.max_steps = 3;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  EXPECT_EQ(summary.termination, Termination::kMaxSteps);
  EXPECT_EQ(summary.message, "the limit of 3 steps was reached");
  ASSERT_EQ(summary.steps.size(), 3u);
  EXPECT_EQ(summary.steps.back().k, 3);
  EXPECT_EQ(summary.steps.back().enclosed, shape.geometry().enclosed());
  EXPECT_EQ(summary.steps.back().n_vertices, shape.geometry().n_vertices());
  EXPECT_EQ(summary.steps.back().n_elements, shape.geometry().n_elements());
  J.reset(shape.geometry());
  EXPECT_NEAR(summary.final_energy, J.value(), 1e-12 * J.value());
}

TYPED_TEST(Evolution, SaysWhatIsInTheWayOfAnyStep) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(start<Dim>());
  shape.smallest_radius = 10;
  shape.is_frozen = true;
  auto J = valley_energy<Dim>();
  const FlowSummary summary = evolve<Dim>(shape, J, {});
  EXPECT_EQ(summary.termination, Termination::kObstacle);
  EXPECT_TRUE(summary.steps.empty());
}

TYPED_TEST(Evolution, TakesNoStepIfNoneIsAllowed) {
  FlowOptions options;
  options.max_steps = 0;
  const FlowSummary summary = descend<TypeParam::value>(options);
  EXPECT_EQ(summary.termination, Termination::kMaxSteps);
  EXPECT_EQ(summary.initial_energy, summary.final_energy);
  EXPECT_TRUE(summary.steps.empty());
}

TYPED_TEST(Evolution, ConvergesByTheShapeDerivativeAlone) {
  FlowOptions options;
  options.rel_tol = 1e-2;
  options.energy_tol = 0;
  options.energy_window = 1000;
  const FlowSummary summary = descend<TypeParam::value>(options);
  EXPECT_EQ(summary.termination, Termination::kConverged);
  EXPECT_NE(summary.message.find("shape derivative"), std::string::npos) << summary.message;
  double steepest = 0;
  for (const StepRecord& step : summary.steps)
    steepest = std::max(steepest, std::abs(step.shape_derivative));
  EXPECT_LE(std::abs(summary.steps.back().shape_derivative), 1e-2 * steepest);
}

/// Mending takes back what every step has gained.
template <int Dim>
class Stubborn : public PlainShape<Dim> {
 public:
  explicit Stubborn(const test::Arrays<Dim>& arrays)
      : PlainShape<Dim>(arrays), start_(this->geometry().points()) {}
  bool mend() override {
    this->move_to(start_);
    return true;
  }

 private:
  Points<Dim> start_;
};

TYPED_TEST(Evolution, ConvergesWhereMendingTakesBackAllThatStepsGain) {
  constexpr int Dim = TypeParam::value;
  Stubborn<Dim> shape(start<Dim>());
  auto J = valley_energy<Dim>();
  FlowOptions options;
  options.rel_tol = options.energy_tol = 0;
  options.max_steps = 60;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
}

TYPED_TEST(Evolution, ConvergesWhenNoVertexMovesAnyFurther) {
  FlowOptions options;
  options.rel_tol = options.energy_tol = 0;
  options.energy_window = 3;
  options.displacement_tol_mm = 0.02;
  const FlowSummary summary = descend<TypeParam::value>(options);
  EXPECT_EQ(summary.termination, Termination::kConverged);
  EXPECT_NE(summary.message.find("no vertex moved further"), std::string::npos) << summary.message;
  const auto& steps = summary.steps;
  ASSERT_GT(steps.size(), 3u);
  for (std::size_t k = steps.size() - 3; k < steps.size(); ++k)
    EXPECT_LE(steps[k].max_displacement_mm, 0.02);
}

// Steps bound by their length gain about the same each: 8 of 16 gain half of the whole decrease.
TYPED_TEST(Evolution, DoesNotConvergeByEnergyWhileAPartIsOnItsWay) {
  constexpr int Dim = TypeParam::value;
  FlowOptions options;
  options.energy_tol = 0.5;
  options.max_steps = 40;
  for (const double share : {0.1, 1.0}) {
    options.energy_share_on_the_way = share;
    PlainShape<Dim> shape(start<Dim>());
    shape.longest = 1e-3;
    auto J = valley_energy<Dim>();
    const FlowSummary summary = evolve<Dim>(shape, J, options);
    for (const StepRecord& step : summary.steps)
      ASSERT_GT(step.max_displacement_mm, 0.9e-3);  // all are bound
    if (share == 1) {
      EXPECT_EQ(summary.termination, Termination::kConverged);
      EXPECT_NEAR(double(summary.steps.size()), 16, 4);
    } else {
      EXPECT_EQ(summary.termination, Termination::kMaxSteps) << summary.message;
    }
  }
}

TYPED_TEST(Evolution, StallsWhereTheShapeMayNotMove) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(start<Dim>());
  shape.is_frozen = true;
  auto J = valley_energy<Dim>();
  const FlowSummary summary = evolve<Dim>(shape, J, {});
  EXPECT_EQ(summary.termination, Termination::kStalled);
  EXPECT_TRUE(summary.steps.empty());
  EXPECT_EQ(shape.geometry().points(), start<Dim>().X);
}

TYPED_TEST(Evolution, EndsAtAnObstacleWithItsReason) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(test::unit_sphere<Dim>(3));
  shape.smallest_radius = 0.5;
  energy::BoundaryIntegral<Dim> J(energy::constant_field<Dim>(1));  // shrinks to a point
  FlowOptions options;
  options.energy_tol = 0;
  const FlowSummary summary = evolve<Dim>(shape, J, options);
  EXPECT_EQ(summary.termination, Termination::kObstacle) << summary.message;
  EXPECT_EQ(summary.message, "the object vanished");
  EXPECT_LT(shape.geometry().radius(), 0.5);
}

TYPED_TEST(Evolution, StopsOnRequestWithTheLastStepTaken) {
  constexpr int Dim = TypeParam::value;
  PlainShape<Dim> shape(start<Dim>());
  auto J = valley_energy<Dim>();
  const FlowSummary summary =
      evolve<Dim>(shape, J, {}, [](const StepRecord& record) { return record.k < 2; });
  EXPECT_EQ(summary.termination, Termination::kStopped);
  EXPECT_EQ(summary.steps.size(), 2u);
  EXPECT_EQ(summary.steps.back().enclosed, shape.geometry().enclosed());
}

TYPED_TEST(Evolution, RefusesOptionsThatAreWrong) {
  FlowOptions options;
  options.max_steps = -1;
  EXPECT_THROW(descend<TypeParam::value>(options), UsageError);
}

// Growth against a balance of forces: gamma |Omega| with gamma < 0 against |Gamma| is at rest at
// the radius (Dim - 1) / |gamma|, a maximum; from outside it the shape grows for ever.
TYPED_TEST(Evolution, GrowsAboveTheRadiusOfBalanceAndShrinksBelow) {
  constexpr int Dim = TypeParam::value;
  const double gamma = -(Dim - 1);  // balance at radius 1
  for (const double radius : {0.8, 1.25}) {
    auto arrays = test::unit_sphere<Dim>(3);
    arrays.X *= radius;
    PlainShape<Dim> shape(arrays);
    energy::EnergySum<Dim> J;
    energy::add_minimal_surface<Dim>(J, energy::constant_field<Dim>(1), 1, gamma, {});
    FlowOptions options;
    options.max_steps = 4;
    evolve<Dim>(shape, J, options);
    EXPECT_EQ(shape.geometry().radius() > radius, radius > 1);
    EXPECT_GT(std::abs(shape.geometry().radius() - radius), 0.01);
  }
}

TEST(FlowOptions, NameTheFieldThatIsWrong) {
  const auto error = [](const std::function<void(FlowOptions&)>& change) {
    FlowOptions options;
    change(options);
    return options.error();
  };
  EXPECT_EQ(FlowOptions{}.error(), "");
  EXPECT_EQ(error([](auto& o) { o.max_steps = -1; }), "FlowOptions::max_steps = -1 violates >= 0");
  EXPECT_EQ(error([](auto& o) { o.rel_tol = 1; }),
            "FlowOptions::rel_tol = 1 violates 0 <= rel_tol < 1");
  EXPECT_EQ(error([](auto& o) { o.energy_tol = -1; }),
            "FlowOptions::energy_tol = -1 violates 0 <= energy_tol < 1");
  EXPECT_EQ(error([](auto& o) { o.energy_window = 0; }),
            "FlowOptions::energy_window = 0 violates 1 to 1000000");
  EXPECT_EQ(error([](auto& o) { o.displacement_tol_mm = -1; }),
            "FlowOptions::displacement_tol_mm = -1 violates >= 0");
  EXPECT_NE(error([](auto& o) { o.step.max_trials = 0; }), "");
  EXPECT_NE(error([](auto& o) { o.velocity.beta_floor = -1; }), "");
}

TEST(Termination, HasAName) {
  EXPECT_EQ(to_string(Termination::kConverged), "converged");
  EXPECT_EQ(to_string(Termination::kMaxSteps), "max-steps");
  EXPECT_EQ(to_string(Termination::kStalled), "stalled");
  EXPECT_EQ(to_string(Termination::kObstacle), "obstacle");
  EXPECT_EQ(to_string(Termination::kStopped), "stopped");
}

}  // namespace
}  // namespace surf::flow
