#include "libsurf/segment/ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/detail/curve_setting.h"

namespace surf::curve {
namespace {

constexpr int kSize = 96;

/// A noisy blob and a circle in its middle.
struct Scene {
  PhantomOptions phantom{.size = {kSize, kSize}, .noise = 0.05};
  Image image = make_phantom(phantom);
  CurveSetting setting{image, {}};
  std::unique_ptr<segment::EnergyModel<2>> model =
      setting.make_model({.sigma_mm = 0.7 * image.pixel_size()});
  segment::SeedModel seed = segment::estimate_seed_model<2>(
      *model->intensity(), std::vector<Vector<2>>{center()}, setting.extent());
  segment::LadderOptions options;
  std::vector<segment::StageReport> stages;

  Scene() { options.shape.edge_length_mm = 2 * image.pixel_size(); }

  Vector<2> center() const { return phantom.unit_to_plane() * Vector<2>(0, 0); }

  std::vector<segment::CandidateOf<2>> climb(const segment::ProgressOf<2>& progress = {}) {
    const auto start = [&](double neck_radius) {
      const double r = std::max(7.0, 1.4 * neck_radius) * image.pixel_size();
      return circle(center(), r, r / 4);
    };
    return segment::climb(setting, *model, seed, start, options, stages, progress);
  }
};

TEST(Ladder, PutsTheObjectFirst) {
  Scene scene;
  const auto candidates = scene.climb();
  ASSERT_FALSE(candidates.empty());
  const Segments outline = phantom_contour(scene.phantom);
  const double area = fem::Geometry<2>(outline.points, outline.elements).enclosed();
  // A window ends where f = -beta kappa, up to half the edge's width inside.
  EXPECT_NEAR(std::sqrt(candidates.front().enclosed / area), 1, 0.08);
  EXPECT_TRUE(verify(candidates.front().shape).passed());
}

TEST(Ladder, SortsCandidatesByScoreAndNamesTheirStages) {
  Scene scene;
  const auto candidates = scene.climb();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(candidates[i].score, candidates[i - 1].score);
    }
    EXPECT_EQ(candidates[i].energies.size(), 2u);
    EXPECT_TRUE(std::any_of(scene.stages.begin(), scene.stages.end(), [&](const auto& stage) {
      return stage.name == candidates[i].stage;
    })) << candidates[i].stage;
  }
}

TEST(Ladder, KeepsWhatHasGrownWhenItIsStopped) {
  Scene scene;
  std::atomic<int> n_steps = 0;
  const auto candidates =
      scene.climb([&](const auto&, const auto&, const auto&) { return ++n_steps < 10; });
  ASSERT_FALSE(candidates.empty());
  EXPECT_EQ(candidates.front().score, 0);
  EXPECT_TRUE(verify(candidates.front().shape).passed());
}

}  // namespace
}  // namespace surf::curve
