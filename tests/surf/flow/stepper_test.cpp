#include "libsurf/flow/detail/stepper.h"

#include <limits>

#include "tests/surf/flow/plain_shape.h"

namespace surf::flow {
namespace {

using test::PlainShape;

IN_BOTH_DIMENSIONS(LargestStep);

TYPED_TEST(LargestStep, TakesNoVertexFurtherThanTheShapeAllows) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(3);
  Points<Dim> shift = Points<Dim>::Zero(shape.n_vertices(), Dim);  // no gradient
  shift.col(0).setConstant(-4);
  EXPECT_NEAR(largest_step<Dim>(shape, shift, 0.1, {}), 0.1 / 4, 1e-15);
  // No further than the size of the shape either.
  EXPECT_NEAR(largest_step<Dim>(shape, shift, 100, {}), shape.radius() / 4, 1e-13);
}

// |grad_Gamma x|, the identity of the tangent space, is sqrt(Dim - 1); Alg. 3.
TYPED_TEST(LargestStep, BoundsTheGradientOfTheVelocity) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(3);
  const StepOptions options{.epsilon_tau = 0.01};
  const double tau = largest_step<Dim>(shape, shape.points(), 100, options);
  EXPECT_NEAR(tau * max_velocity_gradient<Dim>(shape, shape.points(), options.exempt_share), 0.01,
              1e-14);
  EXPECT_NEAR(tau, 0.01 / std::sqrt(Dim - 1.0), 1e-10);
}

TYPED_TEST(LargestStep, IsNoneForAVelocityThatIsZeroOrNotFinite) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(1);
  Points<Dim> velocity = Points<Dim>::Zero(shape.n_vertices(), Dim);
  EXPECT_EQ(largest_step<Dim>(shape, velocity, 0.1, {}), 0);
  for (const double bad :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    velocity.setConstant(bad);
    EXPECT_EQ(largest_step<Dim>(shape, velocity, 0.1, {}), 0) << bad;
  }
}

template <int Dim>
struct Run {
  explicit Run(Method method, bool keeps_content = false)
      : moving(test::start<Dim>()), J(test::valley_energy<Dim>()) {
    options.method = method;
    J.reset(moving.geometry());
    std::optional<double> content;
    if (keeps_content) content = moving.geometry().enclosed();
    stepper = make_stepper<Dim>({moving, J, options, content});
  }
  bool advance() {
    const auto shape = moving.geometry();
    if (!stepper->advance(shape, record)) return false;
    moved_mm = (stepper->destination() - shape.points()).rowwise().norm().maxCoeff();
    moving.move_to(stepper->destination());
    return true;
  }

  PlainShape<Dim> moving;
  energy::BoundaryIntegral<Dim> J;
  FlowOptions options;
  StepRecord record;
  double moved_mm = 0;
  std::unique_ptr<Stepper<Dim>> stepper;
};

constexpr Method kMethods[] = {Method::kGradientFlow, Method::kNewton, Method::kLbfgs};

IN_BOTH_DIMENSIONS(EveryStepper);

TYPED_TEST(EveryStepper, DescendsAndSaysWhatItDid) {
  constexpr int Dim = TypeParam::value;
  for (const Method method : kMethods) {
    Run<Dim> run(method);
    for (int k = 0; k < 3; ++k) {
      const double before = run.J.value();
      ASSERT_TRUE(run.advance()) << int(method) << ", step " << k;
      EXPECT_LT(run.J.value(), before);
      EXPECT_EQ(run.record.energy, run.J.value());
      EXPECT_LT(run.record.shape_derivative, 0);
      EXPECT_GT(run.record.tau, 0);
      EXPECT_GE(run.record.n_trials, 1);
      EXPECT_EQ(run.record.max_displacement_mm, run.moved_mm);
      EXPECT_LE(run.moved_mm, run.moving.longest * (1 + 1e-12));
      // The energy's current shape is where the step leads.
      energy::BoundaryIntegral<Dim> afresh = test::valley_energy<Dim>();
      afresh.reset(run.moving.geometry());
      EXPECT_NEAR(run.J.value(), afresh.value(), 1e-13 * afresh.value());
    }
  }
}

// L-BFGS cannot: FlowOptions::error().
TYPED_TEST(EveryStepper, KeepsTheContent) {
  constexpr int Dim = TypeParam::value;
  for (const Method method : {Method::kGradientFlow, Method::kNewton}) {
    Run<Dim> run(method, /*keeps_content=*/true);
    const double content = run.moving.geometry().enclosed();
    for (int k = 0; k < 3; ++k) {
      ASSERT_TRUE(run.advance()) << int(method) << ", step " << k;
      EXPECT_NEAR(run.moving.geometry().enclosed(), content, 1e-12 * content) << int(method);
    }
  }
}

// A shape that refuses every move has no step that decreases J.
TYPED_TEST(EveryStepper, GivesUpWhereNothingMoves) {
  constexpr int Dim = TypeParam::value;
  for (const Method method : kMethods) {
    Run<Dim> run(method);
    run.moving.is_frozen = true;
    const double before = run.J.value();
    EXPECT_FALSE(run.advance()) << int(method);
    EXPECT_EQ(run.J.value(), before) << int(method);
  }
}

}  // namespace
}  // namespace surf::flow
