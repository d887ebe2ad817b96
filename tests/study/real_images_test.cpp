// Thesis 5.1.2 on a phantom of 128^2 pixels; docs/real-images.md has images. Beside each bound
// stands what was measured.
#include <gtest/gtest.h>

#include "tests/bench/real_image_runs.h"

namespace surf::bench {
namespace {

constexpr int kPixels = 128;
constexpr auto kL2 = flow::ScalarProduct::kL2, kH1 = flow::ScalarProduct::kH1;

struct Found {
  Descended end;
  Agreement with;  // the vertebra
};

const Subject& vertebra() {
  static const Subject kSubject =
      vertebra_phantom({.n_pixels = kPixels, .noise = 0.06, .texture = 0.06});
  return kSubject;
}

Found run(int n_seeds, flow::ScalarProduct product, bool is_selective = true) {
  const RealImageParameters parameters = vertebra_parameters();
  const Prepared prepared = prepare(vertebra().image, parameters, is_selective);
  Found out{descend(prepared, parameters, vertebra_seeds(kPixels, n_seeds), product), {}};
  out.with = agreement(out.end.curves, vertebra());
  return out;
}

TEST(RealImagesStudy, OneSeedAndThreeFindTheVertebraAndThreeNeedFewerSteps) {
  for (const auto product : {kL2, kH1}) {
    const Found one = run(1, product), three = run(3, product);
    EXPECT_LT(three.end.n_steps, one.end.n_steps);
    for (const Found& out : {one, three}) {
      EXPECT_EQ(out.with.n_regions, 1u);
      EXPECT_NEAR(out.end.J_last, -0.5336, 0.003);
      EXPECT_LT(out.with.mean_px, 0.75);  // 0.60 to 0.64
      EXPECT_GT(out.with.dice, 0.955);    // 0.966 to 0.970
    }
  }
}

// As with the thesis' tiger the flows are alike in steps here: no step may go further than the
// image's edges are wide.
TEST(RealImagesStudy, BothFlowsEndAtOneEnergyInAboutAsManySteps) {
  const Found L2 = run(1, kL2), H1 = run(1, kH1);
  EXPECT_LE(L2.end.n_steps, 54);                    // 45
  EXPECT_LE(H1.end.n_steps, 67);                    // 56
  EXPECT_NEAR(H1.end.J_last, L2.end.J_last, 2e-4);  // 4e-5
  const Found L2_three = run(3, kL2), H1_three = run(3, kH1);
  EXPECT_LE(L2_three.end.n_steps, 41);                          // 34
  EXPECT_LE(H1_three.end.n_steps, 47);                          // 39
  EXPECT_NEAR(H1_three.end.J_last, L2_three.end.J_last, 2e-4);  // 3e-5
}

TEST(RealImagesStudy, WithoutSelectiveSmoothingTheTextureHoldsTheCurvesUp) {
  for (const auto product : {kL2, kH1}) {
    const Found with = run(1, product, true), without = run(1, product, false);
    EXPECT_GT(without.with.mean_px, 3 * with.with.mean_px);  // 4.6 and 4.7 times
    EXPECT_LT(without.with.dice, 0.93);                      // 0.891 and 0.888
  }
}

}  // namespace
}  // namespace surf::bench
