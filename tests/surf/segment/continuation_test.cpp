// Alg. 17 on volumes.
#include <gtest/gtest.h>

#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

// Off by default, since it does not pay; it ends at the same minimum.
TEST(Continuation, EndsAtTheMinimumOnVolumesToo) {
  volume::PhantomOptions phantom;
  phantom.kind = volume::PhantomKind::kBall;
  phantom.size = {40, 40, 40};
  phantom.noise = 0.1;
  const volume::Volume image = volume::make_phantom(phantom);
  SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 0.8, 0.1);
  options.energies = {{"mumford-shah", 1, {}}};
  const SegmentResult without = segment(image, options);
  for (const StageReport& stage : without.stages) EXPECT_NE(stage.name, "coarse");
  options.n_coarse_steps = 150;
  const SegmentResult result = segment(image, options);
  ASSERT_FALSE(result.stages.empty());
  EXPECT_EQ(result.stages.front().name, "coarse");
  EXPECT_EQ(result.stages.back().name, "evolve");
  EXPECT_TRUE(mesh::verify(result.shape).passed());
  const double J = without.last().final_energy;
  EXPECT_NEAR(result.last().final_energy, J, 1e-3 * J);
}

// A stop in its first part and one in its last: each part is done once.
TEST(Continuation, GoesOnAtThePartInWhichItWas) {
  volume::PhantomOptions phantom;
  phantom.size = {32, 32, 32};
  Segmentation<3> s(make_setting(volume::make_phantom(phantom)));
  const int object = s.add_object();
  Options<3> options;
  options.initial = mesh::ball({0, 0, 0}, 0.75, 0.1);
  options.energies = {{"mumford-shah", 1, {}}};
  options.n_coarse_steps = 150;
  s.set_options(object, options);
  const auto stopped_in = [&](const std::string& name) -> const Result<3>& {
    return s.evolve(
        object, [&](const std::string& stage, const auto&, const auto&) { return stage != name; });
  };
  EXPECT_EQ(stopped_in("coarse").main_stage()->name, "coarse");
  const Result<3>& second = stopped_in("evolve");
  EXPECT_EQ(second.stages.at(1).name, "coarse");
  ASSERT_EQ(second.main_stage()->name, "evolve");
  const Result<3>& end = s.evolve(object);
  EXPECT_EQ(end.stages.at(1).name, "evolve");
  EXPECT_EQ(end.outcome, Outcome::kConverged);
}

}  // namespace
}  // namespace surf::segment
