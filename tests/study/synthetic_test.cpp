// Thesis 5.1.1 on an image of 256^2 pixels; docs/synthetic-study.md has all of it at 1024^2. Beside
// each bound stands what was measured; distances are in units, half the image's side.
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/bench/synthetic_runs.h"

namespace surf::bench {
namespace {

constexpr int kPixels = 256;
constexpr auto kL2 = flow::ScalarProduct::kL2, kH1 = flow::ScalarProduct::kH1;

SyntheticOutcome outcome(const std::string& section, const std::string& name,
                         flow::ScalarProduct product) {
  for (const Experiment& one : experiments())
    if (one.section == section && one.name == name) return run(one, product, kPixels);
  throw std::invalid_argument(section + ", " + name);
}

// Figs. 5.3 and 5.7: both flows end at the boundary, but for the concavity, which gamma = 0 spans.
TEST(SyntheticStudy, BothFlowsFindTheBoundaryAndH1TakesFewerSteps) {
  const SyntheticOutcome L2 = outcome("edge width", "eps 0.05", kL2);
  const SyntheticOutcome H1 = outcome("edge width", "eps 0.05", kH1);
  EXPECT_LE(L2.end.n_steps, 100);  // 84
  EXPECT_LE(H1.end.n_steps, 40);   // 33
  EXPECT_LT(2 * H1.end.n_steps, L2.end.n_steps);
  for (const SyntheticOutcome& out : {L2, H1}) {
    EXPECT_EQ(out.end.stop, "converged");
    EXPECT_LT(out.end.J_last, 1.78);  // 1.743 and 1.744
    EXPECT_LT(out.mean, 0.0125);      // 0.0105
    EXPECT_EQ(found(out), "not the concavity");
  }
}

TEST(SyntheticStudy, WideEdgesAreReachedInFewerSteps) {
  const SyntheticOutcome narrow = outcome("edge width", "eps 0.025", kH1);
  const SyntheticOutcome wide = outcome("edge width", "eps 0.1", kH1);
  EXPECT_LE(narrow.end.n_steps, 62);  // 52
  EXPECT_LE(wide.end.n_steps, 27);    // 22
  EXPECT_LT(wide.end.n_steps, narrow.end.n_steps);
  EXPECT_LT(narrow.mean, 0.0115);  // 0.0096
  EXPECT_LT(wide.mean, 0.021);     // 0.0175
}

// Fig. 5.9: nothing but gamma drives the curve into the concavity.
TEST(SyntheticStudy, TheDomainTermEntersTheConcavity) {
  const SyntheticOutcome without = outcome("domain term", "gamma 0", kH1);
  const SyntheticOutcome with = outcome("domain term", "gamma 10", kH1);
  EXPECT_GT(without.missed, 0.45);  // the depth of the concavity is 0.5
  EXPECT_LE(with.end.n_steps, 45);  // 37
  EXPECT_LT(with.end.J_last, 9);    // 8.911
  EXPECT_LT(with.mean, 0.0026);     // 0.0021
  EXPECT_LT(with.missed, 0.16);     // 0.128
}

// Fig. 5.12: waves as steep as the edges hold the curve up.
TEST(SyntheticStudy, WavesInTheBackgroundCostSteps) {
  const SyntheticOutcome calm = outcome("edge strength", "lambda 25", kH1);
  const SyntheticOutcome waves = outcome("waves", "N 2, A 1", kH1);
  EXPECT_LE(calm.end.n_steps, 50);  // 41
  EXPECT_GT(waves.end.n_steps, 2 * calm.end.n_steps);
  EXPECT_LT(waves.mean, 0.0147);  // 0.0122
}

}  // namespace
}  // namespace surf::bench
