// From the state after any stage a run goes on to the same result, to the bit.
#include "libsurf/segment/checkpointing.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tests/surf/segment/phantoms.h"

namespace surf::segment {
namespace {

using States = std::vector<std::string>;

struct End {
  Result<3> result;
  std::string recipe;
  States states;
};

End run(const std::vector<EnergyTerm>& energies, const std::string& state = "",
        const ProgressOf<3>& progress = {}, std::stop_source stop = std::stop_source(),
        std::size_t n_states_to_stop = 0, bool keeps_content = false) {
  static const auto setting = make_setting(test::phantom(volume::PhantomKind::kBall, 40, 0.1));
  Segmentation<3> s(setting);
  const int object = s.add_object("ball");
  Options<3> options;
  options.energies = energies;
  options.n_levels = 2;
  options.flow.keep_content = keeps_content;
  s.set_options(object, options);
  s.add_click(object, {{0.1, 0, 0}, Side::kInside});
  End out;
  s.set_checkpointing({[&](const std::string& kept) {
                         out.states.push_back(kept);
                         if (out.states.size() == n_states_to_stop) stop.request_stop();
                       },
                       state});
  out.result = s.evolve(object, progress, stop.get_token());
  out.recipe = to_recipe(s);
  return out;
}

void expect_same(const End& a, const End& b) {
  EXPECT_EQ(a.result.shape.points, b.result.shape.points);
  EXPECT_EQ(a.result.shape.elements, b.result.shape.elements);
  EXPECT_EQ(a.result.start.points, b.result.start.points);
  EXPECT_EQ(a.result.outcome, b.result.outcome);
  EXPECT_EQ(a.result.message, b.result.message);
  EXPECT_EQ(a.result.energies, b.result.energies);
  EXPECT_EQ(a.result.notes, b.result.notes);
  EXPECT_EQ(a.result.n_steps(), b.result.n_steps());
  EXPECT_EQ(a.result.proposals.size(), b.result.proposals.size());
  EXPECT_EQ(a.result.verdict.has_value(), b.result.verdict.has_value());
  ASSERT_EQ(a.result.certainty.has_value(), b.result.certainty.has_value());
  if (a.result.certainty) {
    EXPECT_EQ(a.result.certainty->deviation_mm, b.result.certainty->deviation_mm);
    EXPECT_EQ(a.result.certainty->has_edge, b.result.certainty->has_edge);
  }
  EXPECT_EQ(a.recipe, b.recipe);
}

class Resuming : public ::testing::TestWithParam<std::vector<EnergyTerm>> {};

TEST_P(Resuming, FromAnyStageTheEndIsTheSameToTheBit) {
  const End whole = run(GetParam());
  ASSERT_GE(whole.states.size(), 3u);
  for (const std::string& state : whole.states) {
    const End resumed = run(GetParam(), state);
    expect_same(whole, resumed);
    EXPECT_LT(resumed.states.size(), whole.states.size());
  }
}

// A recipe counts the calls of the progress to the one that stopped it, from the beginning.
TEST_P(Resuming, ARunThatGoesOnAndIsStoppedHasARecipeOfTheWhole) {
  const auto stopping = [](const std::string& stage, const flow::StepRecord& record, const auto&) {
    return stage != "evolve" || record.k < 3;
  };
  const End whole = run(GetParam(), "", stopping);
  ASSERT_EQ(whole.result.outcome, Outcome::kStopped);
  ASSERT_FALSE(whole.states.empty());
  expect_same(whole, run(GetParam(), whole.states.back(), stopping));
}

// A correction that is interrupted takes back what others before it have done, in this run or not.
TEST(ResumingFrom, AStopInACorrectionGoesBackToTheLastStep) {
  const std::vector<EnergyTerm> energies = {{"minimal-surface", 1, {}}};
  const States all = run(energies).states;
  std::stop_source now;
  const End whole = run(energies, "", {}, now, all.size());
  ASSERT_EQ(whole.result.outcome, Outcome::kStopped);
  std::stop_source before;
  before.request_stop();
  const End resumed = run(energies, all.back(), {}, before);
  expect_same(whole, resumed);
  EXPECT_TRUE(resumed.states.empty());
}

// What the search found is in no state: a stop in it leaves nothing, in this run or not.
TEST(ResumingFrom, AStopInTheSearchIsOneBeforeTheFirstStep) {
  const ProgressOf<3> stopping = [](const std::string& stage, const auto&, const auto&) {
    return stage != "propose";
  };
  const States all = run({}).states;
  ASSERT_FALSE(all.empty());
  const End whole = run({}, "", stopping);
  ASSERT_EQ(whole.result.outcome, Outcome::kStopped);
  expect_same(whole, run({}, all.back(), stopping));
}

INSTANTIATE_TEST_SUITE_P(, Resuming,
                         ::testing::Values(std::vector<EnergyTerm>{},
                                           std::vector<EnergyTerm>{{"minimal-surface", 1, {}}}),
                         [](const auto& way) {
                           return way.param.empty() ? "Automatic" : "Explicit";
                         });

// That of the start, which no shape after the first stage has.
TEST(ResumingFrom, AnyStageTheVolumeThatIsKeptIsTheSame) {
  const std::vector<EnergyTerm> energies = {{"chan-vese", 1, {}}, {"area", 0.02, {}}};
  const auto keeping = [&](const std::string& state) {
    return run(energies, state, {}, std::stop_source(), 0, true);
  };
  const End whole = keeping("");
  ASSERT_GE(whole.states.size(), 3u);
  for (const std::string& state : whole.states) expect_same(whole, keeping(state));
}

TEST(ResumingFrom, AStateThatIsNoneIsTold) {
  for (const char* state : {"{", "[]", "{\"n_stages\":1}",
                            "{\"n_stages\":99,\"goes_on\":true,"
                            "\"reports\":[]}"})
    EXPECT_THROW(run({}, state), InputError) << state;
}

}  // namespace
}  // namespace surf::segment
