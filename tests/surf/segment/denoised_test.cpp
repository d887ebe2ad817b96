#include "libsurf/segment/denoised.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

constexpr double kSpacingMm = 1.5;
constexpr double kRadiusMm = 0.6 * 0.5 * 39 * kSpacingMm;

volume::Volume ball(double noise) {
  volume::PhantomOptions options;
  options.size = {40, 40, 40};
  options.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
  options.noise = noise;
  return volume::make_phantom(options);
}

/// Mean square difference.
double mean_square(const volume::Volume& a, const volume::Volume& b) {
  double sum = 0;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) sum += std::pow(a.value(i, j, k) - b.value(i, j, k), 2);
  return sum / (40.0 * 40 * 40);
}

TEST(Denoised, TakesEightDecibelOfTheNoiseAwayAndKeepsTheEdge) {
  const volume::Volume clean = ball(0), noisy = ball(0.25);
  const Triangles surface = mesh::ball({0, 0, 0}, kRadiusMm, 2);
  const volume::Volume u = denoised(noisy, surface, 20);
  EXPECT_GT(10 * std::log10(mean_square(noisy, clean) / mean_square(u, clean)), 8);
  // The voxels on both sides of the ball's end along i: 1 and 0 apart from the soft edge.
  const int inside = static_cast<int>(19.5 + kRadiusMm / kSpacingMm);
  EXPECT_GT(u.value(inside, 19, 19) - u.value(inside + 1, 19, 19), 0.5);
}

TEST(Denoised, BlocksAreSeamless) {
  // exp(-8) of what lies beyond a margin, of a noise of 0.25
  constexpr double kTolerance = 2e-4;
  const volume::Volume noisy = ball(0.25);
  const Triangles surface = mesh::ball({0, 0, 0}, kRadiusMm, 2);
  const volume::Volume whole = denoised(noisy, surface, 2);
  DenoisedOptions small;
  small.block = 13;
  const volume::Volume pieces = denoised(noisy, surface, 2, small);
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i)
        ASSERT_NEAR(whole.value(i, j, k), pieces.value(i, j, k), kTolerance)
            << i << ", " << j << ", " << k;
}

TEST(Denoised, KeepsMeansOfBothSides) {
  // int u = int I on each side; voxels stand for the cells about them, the surface cuts them.
  constexpr double kTolerance = 0.02;
  const volume::Volume image = ball(0.1);
  const volume::Volume u = denoised(image, mesh::ball({0, 0, 0}, kRadiusMm, 2), 1e5);
  EXPECT_NEAR(u.value(19, 19, 19), 1, 0.1);  // the soft edge lowers it
  EXPECT_NEAR(u.value(19, 19, 19), u.value(19, 25, 19), kTolerance);
  EXPECT_NEAR(u.value(0, 0, 0), u.value(39, 39, 20), kTolerance);
  EXPECT_NEAR(u.value(0, 0, 0), 0, 0.1);
}

TEST(Denoised, RefusesWhatIsNoSmoothing) {
  EXPECT_THROW(denoised(ball(0), mesh::ball({0, 0, 0}, 5, 2), 0), UsageError);
}

TEST(MumfordShahRun, FindsANoisyBallWhichTheMinimalSurfaceModelLoses) {
  const volume::Volume noisy = ball(0.25);
  const auto share_found = [&](const char* energy) {
    SegmentOptions options;
    options.initial = mesh::ball({0, 0, 0}, 0.7 * kRadiusMm, 2);
    options.energies = {{energy, 1, {}}};
    const SegmentResult result = segment(noisy, options);
    double volume = 0;
    for (const auto t : result.shape.elements.rowwise()) {
      const Eigen::Vector3d a = result.shape.points.row(t[0]), b = result.shape.points.row(t[1]),
                            c = result.shape.points.row(t[2]);
      volume += a.dot(b.cross(c)) / 6;
    }
    return volume / (4 * M_PI / 3 * std::pow(kRadiusMm, 3));
  };
  EXPECT_NEAR(share_found("mumford-shah"), 1, 0.03);
  EXPECT_LT(share_found("minimal-surface"), 0.8);
}

TEST(MumfordShahRun, RefusesParametersOfThePlane) {
  SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 10, 2);
  options.energies = {{"mumford-shah", 1, {{"data-tolerance", 0.1}}}};
  EXPECT_THROW(segment(ball(0), options), UsageError);
}

TEST(Denoised, OptionsAreChecked) {
  const volume::Volume volume = ball(0);
  const Triangles surface = mesh::ball({0, 0, 0}, 10, 2);
  EXPECT_THROW(denoised(volume, surface, 20, {.block = 0}), UsageError);
  EXPECT_THROW(denoised(volume, surface, 20, {.margin = -1}), UsageError);
  EXPECT_EQ((DenoisedOptions{.tolerance = 0}).error(),
            "DenoisedOptions::tolerance = 0 violates > 0");
}

}  // namespace
}  // namespace surf::segment
