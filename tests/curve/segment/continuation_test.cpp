// The loop of Alg. 17.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"

namespace surf::curve {
namespace {

CurveResult evolved(double noise, bool may_return) {
  CurveOptions options;
  options.initial = circle({63.5, 63.5}, 55, 1.5);
  options.energies = {{"mumford-shah", 1, {}}};
  options.continuation_returns = may_return;
  return segment(make_phantom({.size = {128, 128}, .noise = noise}), options);
}

bool has_grown(const segment::StageReport& stage) {
  return stage.message.find("grown again") != std::string::npos;
}

// Wherever |dJ| has come to by the last step of a stage, the next one is that of its interval.
TEST(Continuation, GoesWhereTheShapeDerivativeIs) {
  int n_returns = 0;
  for (const double noise : {0.1, 0.25, 0.4}) {
    const CurveResult result = evolved(noise, true);
    EXPECT_TRUE(verify(result.shape).passed());
    ASSERT_EQ(result.stages.front().name, "coarse");
    EXPECT_EQ(result.stages.back().name, "evolve");
    double largest = 0;
    for (std::size_t k = 0; k + 1 < result.stages.size(); ++k) {
      const auto& stage = result.stages[k];
      for (const auto& step : stage.flow.steps)
        largest = std::max(largest, std::abs(step.shape_derivative));
      const double last = std::abs(stage.flow.steps.back().shape_derivative) / largest;
      const bool has_fallen = stage.message.find("has fallen") != std::string::npos;
      if (k == 0 || has_fallen || has_grown(stage)) {
        EXPECT_EQ(result.stages[k + 1].name, last < 5e-4 ? "evolve" : "continued") << noise;
      }
      n_returns += has_grown(stage);
    }
  }
  EXPECT_GT(n_returns, 0);
}

TEST(Continuation, OneWayNeverGoesBack) {
  for (const double noise : {0.25, 0.4}) {
    const CurveResult result = evolved(noise, false);
    for (const auto& stage : result.stages) EXPECT_FALSE(has_grown(stage)) << stage.message;
    EXPECT_EQ(result.stages.back().name, "evolve");
    EXPECT_LT(result.last().final_energy, 1.001 * evolved(noise, true).last().final_energy);
  }
}

}  // namespace
}  // namespace surf::curve
