// Thesis 5.2 on images of 64^2 pixels; docs/mumford-shah.md has it at 256^2. Beside each bound
// stands what was measured.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "libcurve/mesh/primitives.h"
#include "libsurf/fem/geometry.h"
#include "tests/bench/mumford_shah_runs.h"

namespace surf::bench {
namespace {

constexpr double kMu = 60, kGamma = 0.25;  // pixel^2, pixels
const Vector<2> kCentre(31.5, 31.5);
constexpr double kEdge = 1.5;

Subject subject(curve::PhantomKind kind, double noise, double linear = 0) {
  Subject out = phantom_subject("phantom",
                                {.kind = kind,
                                 .size = {64, 64},
                                 .edge_width = 0.1,
                                 .noise = noise,
                                 .linear_background = linear},
                                curve::circle(kCentre, 27, kEdge));
  out.mu = kMu;
  out.gamma = kGamma;
  return out;
}

double length(const Segments& curves) {
  return fem::Geometry<2>(curves.points, curves.elements).measure();
}

// 5.2.1
TEST(MumfordShahStudy, BothFlowsEndAtOneEnergyAndH1TakesFewerSteps) {
  const Subject bay = subject(curve::PhantomKind::kBay, 0.1);
  const Outcome L2 = run_flow(bay, flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit);
  const Outcome H1 = run_flow(bay, flow::ScalarProduct::kH1, flow::Scheme::kExplicit);
  const double J_L2 = L2.result.last().final_energy, J_H1 = H1.result.last().final_energy;
  EXPECT_LE(L2.n_steps, 36);  // 28
  EXPECT_LE(H1.n_steps, 24);  // 18
  EXPECT_LT(H1.n_steps, L2.n_steps);
  EXPECT_NEAR(J_H1, 66.36, 0.2);         // 66.30
  EXPECT_NEAR(J_L2, J_H1, 1e-3 * J_H1);  // 4e-4
  for (const Outcome& out : {L2, H1}) {
    const Agreement of = agreement(out.result.shape, bay);
    EXPECT_EQ(of.n_regions, 1u);
    EXPECT_LT(of.mean_px, 0.29);  // 0.24
    EXPECT_GT(of.dice, 0.975);    // 0.987
  }
}

// 5.2.2: u is closer to the clean image than the noisy one is.
TEST(MumfordShahStudy, DenoisesTheMoreTheMoreNoiseThereIs) {
  const Subject bay = subject(curve::PhantomKind::kBay, 0);
  struct Bound {
    double noise, gain_dB, mean_px;
    int n_steps;
  };
  for (const Bound& bound : {Bound{0.1, 0.5, 0.29, 36},    // 0.9, 0.24, 28
                             Bound{0.25, 8, 0.38, 54},     // 8.7, 0.31, 42
                             Bound{0.5, 13, 0.56, 90}}) {  // 13.7, 0.46, 74
    SCOPED_TRACE(bound.noise);
    const curve::Image noisy = with_noise(bay, bound.noise);
    const Outcome out = run(noisy, bay.start, options_of(bay.mu, bay.gamma));
    ASSERT_FALSE(out.is_empty());
    const curve::Image u = curve::denoised(noisy, out.options, out.result);
    EXPECT_GT(psnr(u, bay) - psnr(noisy, bay), bound.gain_dB);
    EXPECT_LT(agreement(out.result.shape, bay).mean_px, bound.mean_px);
    EXPECT_LE(out.n_steps, bound.n_steps);
  }
}

// 5.2.3: u may vary the less, and costs the more, the larger mu is; gamma shortens the curve.
TEST(MumfordShahStudy, MuCostsEnergyAndGammaShortensTheCurve) {
  const Subject bay = subject(curve::PhantomKind::kBay, 0.1, 0.5);
  double last_J = 0;
  for (const double mu : {kMu / 4, kMu, 4 * kMu}) {
    const Outcome out = run(bay.image, bay.start, options_of(mu, kGamma));
    EXPECT_GT(out.result.last().final_energy, 1.08 * last_J) << "mu " << mu;  // 66.5, 74.1, 83.8
    last_J = out.result.last().final_energy;
    EXPECT_LT(agreement(out.result.shape, bay).mean_px, 0.31) << "mu " << mu;  // 0.24 to 0.26
  }
  const auto length_with = [&](double gamma) {
    return length(run(bay.image, bay.start, options_of(kMu, gamma)).result.shape);
  };
  EXPECT_LT(length_with(0.5), 0.96 * length_with(0.05));  // 153.2 and 163.0
}

// 5.2.4: outside, inside, across, many.
TEST(MumfordShahStudy, EndsAtOneEnergyFromDifferentStarts) {
  const Subject bay = subject(curve::PhantomKind::kBay, 0.1);
  const std::vector<std::pair<Segments, int>> starts = {
      {curve::circle(kCentre, 29, kEdge), 48},                        // 37
      {curve::circle({22, 25}, 4, kEdge), 120},                       // 97
      {curve::circle({42, 42}, 12, kEdge), 115},                      // 93
      {curve::grid_of_circles({0, 0}, {63, 63}, 16, 5, kEdge), 54}};  // 43
  for (const auto& [start, n_steps] : starts) {
    const Outcome out = run(bay.image, start, options_of(kMu, kGamma));
    EXPECT_NEAR(out.result.last().final_energy, 66.36, 0.2);    // 66.33 to 66.37
    EXPECT_LT(agreement(out.result.shape, bay).mean_px, 0.29);  // 0.24
    EXPECT_LE(out.n_steps, n_steps);
  }
}

}  // namespace
}  // namespace surf::bench
