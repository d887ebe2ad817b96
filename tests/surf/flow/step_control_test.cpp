#include "libsurf/flow/step_control.h"

#include "tests/surf/fixtures.h"

namespace surf::flow {
namespace {

/// J(tau) = -tau + tau^2 / (2 newton): minimal at tau = newton, where half of the expected decrease
/// is reached. actual / expected = 1 - tau / (2 newton).
struct Quadratic {
  double newton;
  std::vector<double> tried = {};

  std::function<Trial(double)> attempt() {
    return [this](double tau) {
      tried.push_back(tau);
      return Trial{-tau + tau * tau / (2 * newton), -tau};
    };
  }
};

constexpr double kFar = 1e6;

TEST(LineSearch, AcceptsTheExactNewtonStepAtOnce) {
  Quadratic J{.newton = 1};
  const auto step = choose_step({}, 1, kFar, J.attempt());
  ASSERT_TRUE(step);
  EXPECT_EQ(step->tau, 1);
  EXPECT_EQ(step->n_trials, 1);
  EXPECT_EQ(step->trial.change, -0.5);
}

/// The band alpha <= actual / expected <= beta: newton / 2 <= tau <= 3 newton / 2.
void expect_within_band(const std::optional<Step>& step, const Quadratic& J) {
  ASSERT_TRUE(step);
  EXPECT_GE(step->tau, 0.5 * J.newton);
  EXPECT_LE(step->tau, 1.5 * J.newton);
  EXPECT_EQ(step->tau, J.tried.back());
  EXPECT_EQ(step->n_trials, static_cast<int>(J.tried.size()));
}

TEST(LineSearch, ShrinksAStepThatIsTooLong) {
  Quadratic J{.newton = 1};
  const auto step = choose_step({}, 20, kFar, J.attempt());
  expect_within_band(step, J);
  EXPECT_TRUE(std::is_sorted(J.tried.rbegin(), J.tried.rend()));
}

TEST(LineSearch, GrowsAStepThatIsTooShort) {
  Quadratic J{.newton = 1};
  const auto step = choose_step({}, 0.03, kFar, J.attempt());
  expect_within_band(step, J);
  EXPECT_TRUE(std::is_sorted(J.tried.begin(), J.tried.end()));
}

TEST(LineSearch, DoesNotDependOnTheScaleOfStepAndEnergy) {
  for (const double scale : {1e-8, 1e8}) {
    Quadratic J{.newton = scale};
    expect_within_band(choose_step({}, 0.01 * scale, 1e3 * scale, J.attempt()), J);
  }
}

TEST(FixedStep, IsTakenWhateverItGains) {
  Quadratic J{.newton = 0.1};  // ten times too long: J grows
  const auto step = choose_step({.rule = StepRule::kFixed, .tau = 1}, 0.01, 3, J.attempt());
  ASSERT_TRUE(step);
  EXPECT_EQ(step->tau, 1);
  EXPECT_GT(step->trial.change, 0);
  EXPECT_EQ(choose_step({.rule = StepRule::kFixed, .tau = 1}, 1, 0.5, J.attempt())->tau, 0.5);
}

TEST(FixedStep, IsHalvedWhereThereIsNoShape) {
  const auto attempt = [](double tau) {
    return Trial{tau > 0.3 ? std::numeric_limits<double>::infinity() : 1, -1};
  };
  const auto step = choose_step({.rule = StepRule::kFixed, .tau = 1}, 1, 3, attempt);
  ASSERT_TRUE(step);
  EXPECT_EQ(step->tau, 0.25);
  EXPECT_EQ(step->n_trials, 3);
}

TEST(LineSearch, TakesTheLargestStepHoweverMuchItGains) {
  Quadratic J{.newton = 100};
  const auto step = choose_step({}, 1, 3, J.attempt());
  ASSERT_TRUE(step);
  EXPECT_EQ(step->tau, 3);
  EXPECT_EQ(*std::max_element(J.tried.begin(), J.tried.end()), 3);
}

// A step that decreases J too steeply for the band, before a cliff: no step lies in the band, the
// best one below the cliff is taken, and tried last.
TEST(LineSearch, FallsBackToTheLongestGoodStepBeforeACliff) {
  std::vector<double> tried = {};
  const auto step = choose_step({}, 0.1, kFar, [&](double tau) {
    tried.push_back(tau);
    return Trial{tau < 1 ? -tau : 10.0, -tau};
  });
  ASSERT_TRUE(step);
  EXPECT_LT(step->tau, 1);
  EXPECT_GT(step->tau, 0.8);  // bisection ends within 20 %
  EXPECT_EQ(step->tau, tried.back());
}

TEST(LineSearch, FindsNothingWhereNoStepDecreasesTheEnergy) {
  int n = 0;
  const auto step = choose_step({.max_trials = 7}, 1, kFar, [&](double tau) {
    ++n;
    return Trial{tau, -tau};
  });
  EXPECT_FALSE(step);
  EXPECT_EQ(n, 7);
}

TEST(Steps, AreNoShorterThanTheLeast) {
  for (const StepRule rule : {StepRule::kLineSearch, StepRule::kBacktracking, StepRule::kFixed}) {
    std::vector<double> tried;
    const auto step = choose_step({.rule = rule, .tau = 8, .tau_min = 2}, 8, 8, [&](double tau) {
      tried.push_back(tau);
      return Trial{std::numeric_limits<double>::infinity(), -tau};
    });
    EXPECT_FALSE(step);
    EXPECT_EQ(tried, (std::vector<double>{8, 4, 2}));
  }
}

TEST(LineSearch, TakesAnInfiniteOrUndefinedEnergyForTooLong) {
  for (const double bad :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    const auto step = choose_step({}, 8, kFar, [&](double tau) {
      return Trial{tau > 2 ? bad : -0.5 * tau, -tau};
    });
    ASSERT_TRUE(step);
    EXPECT_LE(step->tau, 2);
  }
}

TEST(Backtracking, HalvesUntilTheEnergyFalls) {
  Quadratic J{.newton = 1};  // J(tau) < 0 for tau < 2
  const auto step = choose_step({.rule = StepRule::kBacktracking}, 9, kFar, J.attempt());
  ASSERT_TRUE(step);
  EXPECT_EQ(step->tau, 9.0 / 8);
  EXPECT_EQ(step->n_trials, 4);
}

TEST(Backtracking, FindsNothingWhereNoStepDecreasesTheEnergy) {
  const auto step = choose_step({.rule = StepRule::kBacktracking}, 1, 1, [](double tau) {
    return Trial{0, -tau};
  });
  EXPECT_FALSE(step);
}

IN_BOTH_DIMENSIONS(VelocityGradient);

// V = B x has grad_Gamma V = B P with the tangential projection P of each element.
TYPED_TEST(VelocityGradient, OfALinearFieldIsTheMatrixTimesTheTangentialProjection) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  Eigen::Matrix<double, Dim, Dim> B;
  for (int i = 0; i < Dim * Dim; ++i) B.data()[i] = std::cos(3.0 * i);
  double expected = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const Vector<Dim> nu = shape.normals().row(t);
    expected = std::max(expected, (B - B * nu * nu.transpose()).norm());
  }
  const Points<Dim> V = shape.points() * B.transpose();
  EXPECT_NEAR(max_velocity_gradient<Dim>(shape, V), expected, 1e-12);
}

TYPED_TEST(VelocityGradient, LeavesOutTheSteepestElementsUpToTheExemptShare) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(3);
  Points<Dim> V = Points<Dim>::Zero(shape.points().rows(), Dim);
  V(0, 0) = 1e6;  // only the elements of vertex 0 have a gradient
  double share = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    if ((shape.elements().row(t).array() == 0).any()) share += shape.measures()[t];
  share /= shape.measure();
  EXPECT_EQ(max_velocity_gradient<Dim>(shape, V, 1.01 * share), 0);
  EXPECT_GT(max_velocity_gradient<Dim>(shape, V, 0.99 * share), 0);
}

TYPED_TEST(VelocityGradient, OfATranslationIsZero) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::rough_sphere<Dim>(2);
  const Points<Dim> V = Points<Dim>::Constant(arrays.X.rows(), Dim, 3.0);
  EXPECT_LT(max_velocity_gradient<Dim>({arrays.X, arrays.T}, V), 1e-12);
}

TEST(StepOptions, NameTheFieldThatIsWrong) {
  EXPECT_EQ(StepOptions{}.error(), "");
  EXPECT_EQ((StepOptions{.alpha = 0.8}).error(),
            "StepOptions::alpha = 0.8, beta = 0.75 violate 0 < alpha < beta < 1");
  EXPECT_EQ((StepOptions{.epsilon_tau = 0}).error(), "StepOptions::epsilon_tau = 0 violates > 0");
  EXPECT_EQ((StepOptions{.max_trials = 0}).error(), "StepOptions::max_trials = 0 violates >= 1");
  EXPECT_EQ((StepOptions{.tau_min = -1}).error(), "StepOptions::tau_min = -1 violates >= 0");
  EXPECT_EQ((StepOptions{.tau_min = 2, .tau_max = 1}).error(),
            "StepOptions::tau_max = 1 violates > 0 and >= tau_min = 2");
}

}  // namespace
}  // namespace surf::flow
