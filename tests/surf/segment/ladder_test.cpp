#include "libsurf/segment/ladder.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <numbers>

#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/model.h"
#include "libsurf/segment/segment.h"
#include "libsurf/segment/surface_setting.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

constexpr int kSize = 48;
constexpr double kRadius = 0.6;  // of the phantom ball

volume::Volume noisy_ball() {
  volume::PhantomOptions options;
  options.size = {kSize, kSize, kSize};
  options.noise = 0.05;
  return volume::make_phantom(options);
}

struct Scene {
  volume::Volume volume = noisy_ball();
  ImageModel model{
      volume, {.sigma_mm = 0.7 * volume.voxel_size()}, volume::DerivativeFilter::kBSpline};
  SurfaceSetting setting{volume, volume::DerivativeFilter::kBSpline};
  SeedModel seed = estimate_seed_model<3>(
      *model.intensity(), std::vector<Eigen::Vector3d>{{0, 0, 0}}, volume.voxel_size());
  LadderOptions<3> options;
  std::vector<StageReport> stages;

  Scene() { options.shape.edge_length_mm = 2 * volume.voxel_size(); }

  std::vector<Candidate> climb(const Progress& progress = {}) {
    const auto start = [&](double neck_radius) {
      const double r = std::max(0.15, 1.4 * neck_radius * volume.voxel_size());
      return mesh::ball(Eigen::Vector3d::Zero(), r, r / 2);
    };
    return segment::climb<3>(setting, model, seed, start, options, stages, progress);
  }
};

TEST(RungFeatures, ScoreAsTheFormulaSays) {
  RungFeatures rung;
  rung.separation = 0.9;
  rung.edge_share = 0.8;
  rung.sphericity = 0.49;
  rung.growth_in = 0.2;
  rung.growth_out = 1.1;
  EXPECT_DOUBLE_EQ(rung.score(), 0.9 * 0.8 * 0.7 * 1.1 * std::exp(-0.05));
}

TEST(Ladder, PutsTheObjectFirst) {
  Scene scene;
  const auto candidates = scene.climb();
  ASSERT_FALSE(candidates.empty());
  const double ball = 4.0 / 3 * std::numbers::pi * std::pow(kRadius, 3);
  // A window ends where f = -beta kappa, up to half the edge's width (1.2 voxels) inside.
  EXPECT_NEAR(std::cbrt(candidates.front().enclosed / ball), 1, 0.08);
  EXPECT_TRUE(mesh::verify(candidates.front().shape).passed());
}

TEST(Ladder, SortsCandidatesByScoreAndNamesTheirStages) {
  Scene scene;
  const auto candidates = scene.climb();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(candidates[i].score, candidates[i - 1].score);
    }
    EXPECT_EQ(candidates[i].energies.size(), 2u);
    EXPECT_TRUE(
        std::any_of(scene.stages.begin(), scene.stages.end(),
                    [&](const StageReport& stage) { return stage.name == candidates[i].stage; }))
        << candidates[i].stage;
  }
}

TEST(Ladder, KeepsWhatHasGrownWhenItIsStopped) {
  Scene scene;
  std::atomic<int> n_steps = 0;
  const auto candidates =
      scene.climb([&](const auto&, const auto&, const auto&) { return ++n_steps < 30; });
  ASSERT_FALSE(candidates.empty());
  EXPECT_EQ(candidates.front().score, 0);
  EXPECT_TRUE(mesh::verify(candidates.front().shape).passed());
}

}  // namespace
}  // namespace surf::segment
