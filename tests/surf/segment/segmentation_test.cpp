#include "libsurf/segment/segmentation.h"

#include <gtest/gtest.h>

#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tests/surf/segment/dialogues.h"

namespace surf::segment {
namespace {

TEST(Segmentation, GoesFromAClickToASurface) {
  Segmentation<3> s = ball();
  const int object = s.add_object("ball");
  EXPECT_EQ(s.object(object).state(), Outcome::kEmpty);
  s.add_click(object, inside(0.1));
  EXPECT_EQ(s.propose(object).outcome, Outcome::kProposed);
  const Result<3>& result = s.evolve(object);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  EXPECT_NEAR(s.measures(object).content, 4 * std::numbers::pi / 3 * std::pow(0.6, 3), 0.01);
  EXPECT_TRUE(s.measures(object).passed);
}

// What was found without a box is no answer to one.
TEST(Segmentation, LooksAgainInANewBox) {
  Options<3> options;
  options.box_mm = BoxCorners<3>{Vector<3>(-0.5, -0.5, -0.5), Vector<3>(0.1, 0.1, 0.1)};
  Segmentation<3> later = ball(), before = ball();
  const int a = later.add_object(), b = before.add_object();
  later.add_click(a, inside(0));
  const Points<3> whole = later.evolve(a).shape.points;
  later.set_options(a, options);
  EXPECT_EQ(later.object(a).state(), Outcome::kEmpty);
  before.set_options(b, options);
  before.add_click(b, inside(0));
  EXPECT_EQ(later.evolve(a).shape.points, before.evolve(b).shape.points);
  EXPECT_NE(later.object(a).result->shape.points.rows(), whole.rows());
  ASSERT_TRUE(later.undo(a) && later.undo(a));
  EXPECT_EQ(later.object(a).result->shape.points, whole);
}

TEST(Segmentation, NamesTheEnergyThatItMinimised) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  s.add_click(object, inside(0));
  const Result<3>& result = s.evolve(object);
  ASSERT_EQ(result.energies.size(), 3u);
  EXPECT_EQ(result.energies[0].name, "local-means");
  EXPECT_EQ(result.main_stage()->name, "evolve");
  EXPECT_EQ(result.main_stage()->energies, result.energies);
}

// The stated energy from the start that was used, lengths as they were chosen. Along wide edges
// what is seen of them depends on the shape along which one looks.
TEST(Segmentation, GivesTheSameBytesByTheStatedEnergyFromItsStart) {
  for (const double edge_width : {0.05, 0.2}) {
    volume::PhantomOptions options;
    options.size = {40, 40, 40};
    options.noise = 0.1;
    options.edge_width_mm = edge_width;
    const volume::Volume volume = volume::make_phantom(options);
    SegmentOptions automatic;
    automatic.seeds_mm = {Vector<3>::Zero()};
    const SegmentResult first = segment(volume, automatic);
    SegmentOptions stated = automatic;
    stated.initial = first.start;
    stated.energies = first.energies;
    stated.sigma_mm = first.sigma_mm;
    stated.edge_length_mm = first.edge_length_mm;
    stated.geometry_tolerance_mm = first.geometry_tolerance_mm;
    const SegmentResult second = segment(volume, stated);
    EXPECT_EQ(second.shape.points, first.shape.points) << edge_width;
    EXPECT_EQ(second.shape.elements, first.shape.elements) << edge_width;
  }
}

TEST(Segmentation, EndsAtTheLimitOfStepsInEveryMode) {
  for (const bool has_energy : {false, true}) {
    SegmentOptions options;
    options.seeds_mm = {Vector<3>::Zero()};
    options.flow.max_steps = 2;
    if (has_energy) options.energies = {{"minimal-surface", 1, {}}};
    const SegmentResult result = segment(phantom(), options);
    EXPECT_EQ(result.outcome, Outcome::kAtLimit);
    EXPECT_EQ(result.last().steps.size(), 2u);
    EXPECT_TRUE(make_setting(phantom())->measures(result.shape).passed);
  }
}

TEST(Segmentation, FindsNoObjectInAConstantVolume) {
  const volume::Volume volume({16, 16, 16}, Eigen::Affine3d::Identity(),
                              std::vector<float>(16 * 16 * 16, 7.f));
  Segmentation<3> s(make_setting(volume));
  const int object = s.add_object();
  s.add_click(object, inside(8, 8, 8));
  const Result<3>& result = s.evolve(object);
  EXPECT_EQ(result.outcome, Outcome::kNoObject);
  EXPECT_EQ(result.shape.elements.rows(), 0);
  EXPECT_THROW(finish<3>(s.setting(), result, ".stl"), NoObject);
}

TEST(Segmentation, SaysThatAnObjectVanished) {
  SegmentOptions options;
  options.seeds_mm = {Vector<3>::Zero()};
  options.energies = {{"minimal-surface", 1, {{"gamma", 5}, {"lambda", 7}}}};
  const SegmentResult result = segment(phantom(), options);
  EXPECT_EQ(result.outcome, Outcome::kVanished);
  EXPECT_EQ(result.shape.elements.rows(), 0);
}

TEST(Segmentation, StopsOnRequestWithTheSurfaceSoFar) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  s.add_click(object, inside(0));
  std::stop_source source;
  const Result<3>& result = s.evolve(
      object,
      [&](const std::string&, const flow::StepRecord& record, const auto&) {
        if (record.n_elements > 0 && record.k == 2) source.request_stop();
        return true;
      },
      source.get_token());
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_EQ(result.last().steps.size(), 2u);
  EXPECT_TRUE(s.measures(object).passed);
}

// While regions are looked for, and when they have just been found.
TEST(Segmentation, IsTheSameWheneverItWasStoppedBeforeItsFirstStep) {
  int n_calls = 0;  // of the last run: they come now and then
  const auto stopped_at = [&](int n_stop) {
    Segmentation<3> s = ball();
    s.add_click(s.add_object(), inside(0));
    n_calls = 0;
    const Result<3>& result = s.evolve(1, [&](const std::string& stage, const auto&, const auto&) {
      return stage != "propose" || ++n_calls != n_stop;
    });
    if (n_calls < n_stop || n_stop == 0) return std::optional<Simplices<3>>();
    EXPECT_EQ(result.outcome, Outcome::kStopped);
    EXPECT_EQ(result.shape.elements.rows(), 0);
    EXPECT_TRUE(result.proposals.empty());
    return std::optional(s.evolve(1).shape);
  };
  stopped_at(0);
  ASSERT_GT(n_calls, 1);
  std::optional<Simplices<3>> late;
  while (!late) late = stopped_at(n_calls);
  const std::optional<Simplices<3>> early = stopped_at(1);
  ASSERT_TRUE(early);
  EXPECT_EQ(early->points, late->points);
  EXPECT_EQ(early->elements, late->elements);
}

std::stop_token stopped() {
  std::stop_source out;
  out.request_stop();
  return out.get_token();
}

// A surface that is at rest and has a click on its side, but too near.
TEST(Segmentation, EvolvesAfterAStopBeforeItsFirstStepAsWithoutIt) {
  Options<3> options;
  options.edge_length_mm = 0.05;
  options.coarseness = 1;
  Segmentation<3> one = ball(), other = ball();
  for (Segmentation<3>* s : {&one, &other}) {
    const int object = s->add_object();
    s->set_options(object, options);
    s->add_click(object, inside(0));
    s->evolve(object);
    s->add_click(object, inside(0.58));
  }
  ASSERT_EQ(other.evolve(1, {}, stopped()).outcome, Outcome::kStopped);
  const Result<3>&at_once = one.evolve(1), &later = other.evolve(1);
  EXPECT_EQ(later.stages.front().name, at_once.stages.front().name);
  ASSERT_EQ(later.shape.points.rows(), at_once.shape.points.rows());
  EXPECT_EQ(later.shape.points, at_once.shape.points);
}

// There is nothing to go on from, though no click is against that.
TEST(Segmentation, BeginsWithTheInitialShapeAfterAStopBeforeItsFirstStep) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  Options<3> options;
  options.samples_mm = {{0, 0, 0}};
  options.initial = s.setting().ball({0, 0, 0}, 0.4, 0.08);
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  s.set_options(object, options);
  ASSERT_EQ(s.evolve(object, {}, stopped()).shape.elements.rows(), 0);
  EXPECT_EQ(s.evolve(object).start.points, s.setting().in_file_order(*options.initial).points);
  EXPECT_NEAR(s.measures(object).content, 4 * std::numbers::pi / 3 * std::pow(0.6, 3), 0.03);
}

// An energy that is fitted to its start would be fitted to what it has found, again and again: a
// liver grew by 16 % in three such changes.
TEST(Segmentation, OptionsThatComeBackBringTheSurfaceBack) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kBall, 0.1)));
  const int object = s.add_object();
  s.add_click(object, inside(0));
  const Points<3> first = s.evolve(object).shape.points;
  const std::optional<Verdict<3>> verdict = s.object(object).result->verdict_of_region;
  ASSERT_TRUE(verdict);
  for (const double edge : {2.0, 3.0}) {
    Options<3> other;
    other.edge_length_mm = edge * s.setting().extent().cell_mm();
    s.set_options(object, other);
    EXPECT_NE(s.evolve(object).shape.points.rows(), first.rows());
    s.set_options(object, {});
    const Result<3>& again = s.evolve(object);
    ASSERT_EQ(again.shape.points.rows(), first.rows());
    EXPECT_EQ(again.shape.points, first);
    ASSERT_TRUE(again.verdict_of_region);
    EXPECT_EQ(again.verdict_of_region->text(), verdict->text());
  }
}

TEST(Segmentation, GoesOnFromTheShapeThatIsThereByAnEnergy) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  Options<3> options;
  options.energies = {{"minimal-surface", 1, {}}};
  s.set_options(object, options);
  s.add_click(object, inside(0));
  const double first = s.evolve(object).n_steps();
  options.components.fill_cavities = true;
  s.set_options(object, options);
  const Result<3>& second = s.evolve(object);
  EXPECT_EQ(second.outcome, Outcome::kConverged);
  EXPECT_LT(second.n_steps(), first);
}

// In two parts as in one: an energy that makes seeds grow goes on doing so, and a fitted one keeps
// what it was fitted to. Where each comes to rest is told by what a few steps gain: not to the bit.
TEST(Segmentation, GoesOnWithItsEnergyAfterAStop) {
  for (const bool has_energy : {false, true}) {
    Options<3> options;
    if (has_energy) options.energies = {{"minimal-surface", 1, {}}};
    Segmentation<3> whole = ball(), parts = ball();
    for (Segmentation<3>* s : {&whole, &parts}) {
      const int object = s->add_object();
      s->add_click(object, inside(0));
      s->set_options(object, options);
    }
    const Result<3>& at_once = whole.evolve(1);
    EXPECT_EQ(parts.step(1, 3).outcome, Outcome::kStopped);
    EXPECT_EQ(parts.object(1).result->n_steps(), 3);
    const Result<3>& second = parts.evolve(1);
    EXPECT_EQ(second.stages.front().name, "go on");
    EXPECT_EQ(second.outcome, Outcome::kConverged);
    EXPECT_EQ(second.energies, at_once.energies);
    const auto distance = whole.setting().distance_to(at_once.shape);
    double sum = 0;
    for (const auto& point : second.shape.points.rowwise()) sum += distance(point.transpose());
    EXPECT_LT(sum / double(second.shape.points.rows()), 0.05 * parts.setting().extent().cell_mm())
        << has_energy;
    Options<3> finer = options;
    finer.edge_length_mm = 0.5 * at_once.edge_length_mm;
    ASSERT_TRUE(parts.undo(1));
    parts.set_options(1, finer);
    EXPECT_NE(parts.step(1, 1).stages.front().name, "go on");
  }
}

// A level that is done is not begun again, however few steps there are at a time.
TEST(Segmentation, GoesOnAtTheLevelAtWhichItWas) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  Options<3> options;
  options.energies = {{"minimal-surface", 1, {}}};
  options.n_levels = 3;
  s.set_options(object, options);
  s.add_click(object, inside(0));
  const auto minimised = [&] {
    std::vector<std::string> out;
    for (const StageReport& stage : s.object(object).result->stages)
      if (stage.kind == StageKind::kMinimises) out.push_back(stage.name);
    return out;
  };
  s.step(object, 2);
  EXPECT_EQ(minimised(), std::vector<std::string>{"level 2"});
  s.step(object, 1);
  EXPECT_EQ(minimised().front(), "level 2");
  s.evolve(object,
           [](const std::string& stage, const auto&, const auto&) { return stage != "level 1"; });
  EXPECT_EQ(minimised().back(), "level 1");
  s.evolve(object,
           [](const std::string& stage, const auto&, const auto&) { return stage != "evolve"; });
  EXPECT_EQ(minimised(), (std::vector<std::string>{"level 1", "evolve"}));
  EXPECT_EQ(s.evolve(object).outcome, Outcome::kConverged);
  EXPECT_EQ(minimised().front(), "evolve");
}

TEST(Segmentation, LooksForTheObjectAnewWhereAClickIsNotHeeded) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls)));
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  EXPECT_EQ(s.measures(object).n_components, 1);
  s.add_click(object, inside(0.5));
  EXPECT_EQ(s.evolve(object).stages.front().name, "propose");
  EXPECT_EQ(s.measures(object).n_components, 2);
}

TEST(Segmentation, StaysAsItIsWhereAClickIsObeyedAlready) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  s.add_click(object, inside(0));
  const Result<3>* const first = &s.evolve(object);
  ASSERT_TRUE(first->verdict);
  int n_calls = 0;
  const ProgressOf<3> counts = [&](const auto&, const auto&, const auto&) { return ++n_calls > 0; };
  s.add_click(object, inside(0.2));
  s.add_click(object, outside(0.9));
  EXPECT_EQ(&s.evolve(object, counts), first);
  EXPECT_EQ(n_calls, 0);
  // A click nearer than half a voxel, other options: something may move.
  s.add_click(object, inside(0.595));
  EXPECT_NE(&s.evolve(object, counts), first);
  EXPECT_GT(n_calls, 0);
  const Result<3>* const second = s.object(object).result.get();
  Options<3> options;
  options.edge_length_mm = 0.2;
  s.set_options(object, options);
  EXPECT_NE(&s.evolve(object), second);
}

TEST(Segmentation, LosesWhatAClickThatIsTakenBackStoodFor) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls)));
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  const double one = s.measures(object).content;
  s.add_click(object, inside(0.5));
  s.evolve(object);
  EXPECT_NEAR(s.measures(object).content, 2 * one, 0.05 * one);
  s.take_back_click(object, 1);
  s.evolve(object);
  EXPECT_NEAR(s.measures(object).content, one, 0.01 * one);
}

// And by an energy that was given, which looks for nothing: whether regions had been looked for
// before or not, it is as if the click had never been made.
TEST(Segmentation, LosesByAnEnergyWhatAClickThatIsTakenBackStoodFor) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kSeparateBalls));
  Options<3> options;
  options.energies = {{"minimal-surface", 1, {}}};
  Segmentation<3> fresh(setting);
  fresh.add_click(fresh.add_object(), inside(-0.5));
  fresh.set_options(1, options);
  const Points<3> one = fresh.evolve(1).shape.points;
  for (const bool was_looked_for : {false, true}) {
    Segmentation<3> s(setting);
    const int object = s.add_object();
    s.add_click(object, inside(-0.5));
    s.add_click(object, inside(0.5));
    if (was_looked_for) s.evolve(object);
    s.set_options(object, options);
    s.evolve(object);
    EXPECT_EQ(s.measures(object).n_components, 2);
    s.take_back_click(object, 1);
    const Triangles left = s.evolve(object).shape;
    ASSERT_EQ(left.points.rows(), one.rows()) << was_looked_for;
    EXPECT_EQ(left.points, one) << was_looked_for;
    // The next evolution goes on from there.
    Options<3> other = options;
    other.components.fill_cavities = true;
    s.set_options(object, other);
    EXPECT_EQ(s.evolve(object).start.points, setting->in_file_order(left).points);
  }
}

TEST(Segmentation, TakesAnotherProposal) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kShell)));
  const int object = s.add_object();
  s.add_click(object, inside(0.45));
  const auto n = s.propose(object).proposals.size();
  ASSERT_GT(n, 0u);
  EXPECT_THROW(s.choose(object, n), UsageError);
  const Result<3>& chosen = s.choose(object, n - 1);
  EXPECT_EQ(chosen.outcome, Outcome::kProposed);
  EXPECT_EQ(chosen.chosen, n - 1);
  EXPECT_EQ(s.evolve(object).outcome, Outcome::kConverged);
  // And keeps it by options that another search goes with.
  const double content = s.measures(object).content;
  Options<3> options;
  options.sigma_mm = 0.5 * s.setting().extent().cell_mm();
  s.set_options(object, options);
  s.evolve(object);
  EXPECT_NEAR(s.measures(object).content, content, 0.1 * content);
}

TEST(Segmentation, KeepsItsVerdictWhereTheBestProposalIsChosen) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kShell)));
  const int object = s.add_object();
  s.add_click(object, inside(0.45));
  const std::optional<Verdict<3>> verdict = s.propose(object).verdict;
  ASSERT_TRUE(verdict);
  for (std::size_t n = s.object(object).result->proposals.size(); n-- > 0;)
    EXPECT_EQ(s.choose(object, n).verdict.has_value(), n == 0) << n;
  EXPECT_EQ(s.object(object).result->verdict->text(), verdict->text());
  EXPECT_TRUE(s.evolve(object).verdict_of_region);
}

// The last click's first; a click that changes nothing has none of its own.
TEST(Segmentation, KeepsTheCandidatesOfEveryClick) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls)));
  const int object = s.add_object();
  EXPECT_TRUE(s.candidates(object).empty());
  s.add_click(object, inside(-0.5));
  s.propose(object);
  const std::vector<Candidate<3>> first = s.candidates(object);
  ASSERT_FALSE(first.empty());
  s.add_click(object, outside(0, 0.9));
  s.propose(object);
  EXPECT_EQ(s.candidates(object).size(), first.size());
  s.add_click(object, inside(0.5));
  const Result<3>& result = s.propose(object);
  const std::vector<Candidate<3>> all = s.candidates(object);
  ASSERT_EQ(all.size(), result.proposals.size() + first.size());
  for (std::size_t n = 0; n < all.size(); ++n) {
    const bool is_last = n < result.proposals.size();
    const std::size_t place = is_last ? n : n - result.proposals.size();
    const Proposal<3>& expected = is_last ? result.proposals[place] : first[place].proposal;
    EXPECT_EQ(all[n].proposal.shape.points, expected.shape.points) << n;
    EXPECT_EQ(all[n].n_click, is_last ? 3u : 1u) << n;
    EXPECT_EQ(all[n].rank, place + 1) << n;
    EXPECT_EQ(all[n].is_chosen, place == 0) << n;
    EXPECT_TRUE(finish<3>(s.setting(), all[n].proposal, ".stl").measures.passed) << n;
  }
}

TEST(Segmentation, MovesAClickOrLeavesAllAsItIs) {
  Segmentation<3> s = ball();
  const int object = s.add_object(), other = s.add_object();
  s.add_click(other, inside(0.3));
  s.add_click(object, inside(0));
  s.add_click(object, outside(0.9));
  s.move_click(object, 0, {0.1, 0, 0});
  EXPECT_EQ(s.object(object).clicks, (std::vector{outside(0.9), inside(0.1)}));
  EXPECT_EQ(s.history(object).size(), 4u);
  s.rename(object, "ball");
  s.undo(object);
  const std::string recipe = to_recipe<3>(s);
  // Beyond the image, on the outside click, on the other object's, and no such click.
  for (const auto& [index, x] : {std::pair{1, 5.0}, {1, 0.9}, {1, 0.3}, {2, 0.0}}) {
    EXPECT_THROW(s.move_click(object, std::size_t(index), {x, 0, 0}), UsageError) << x;
    EXPECT_EQ(to_recipe<3>(s), recipe) << x;
    ASSERT_NE(s.undone(object), nullptr) << x;
    EXPECT_TRUE(std::holds_alternative<Rename>(*s.undone(object))) << x;
  }
  EXPECT_TRUE(s.redo(object));
  EXPECT_EQ(s.object(object).name, "ball");
}

// As many clicks, but other ones.
TEST(Segmentation, LooksAnewForClicksThatWereNotProposedFor) {
  Segmentation<3> moved(make_setting(phantom(volume::PhantomKind::kSeparateBalls))),
      fresh(make_setting(phantom(volume::PhantomKind::kSeparateBalls)));
  moved.add_click(moved.add_object(), inside(-0.5));
  ASSERT_EQ(moved.propose(1).outcome, Outcome::kProposed);
  moved.move_click(1, 0, {0.5, 0, 0});
  fresh.add_click(fresh.add_object(), inside(0.5));
  EXPECT_EQ(moved.evolve(1).shape.points, fresh.evolve(1).shape.points);
  EXPECT_GT(moved.object(1).result->shape.points.col(0).minCoeff(), 0);
}

TEST(Segmentation, KnowsThatItsShapeIsNotWhatWasAskedForLast) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  EXPECT_FALSE(s.is_outdated(object));
  s.add_click(object, inside(0));
  EXPECT_FALSE(s.is_outdated(object));  // there is none
  s.evolve(object);
  s.rename(object, "ball");
  EXPECT_FALSE(s.is_outdated(object));
  s.take_back_click(object, 0);
  EXPECT_TRUE(s.is_outdated(object));
  s.undo(object);
  EXPECT_FALSE(s.is_outdated(object));
  Options<3> options;
  options.edge_length_mm = 3;
  s.set_options(object, options);
  EXPECT_TRUE(s.is_outdated(object));
  s.evolve(object);
  EXPECT_FALSE(s.is_outdated(object));
}

TEST(Segmentation, RefusesWhatCannotBe) {
  Segmentation<3> s = ball();
  EXPECT_THROW(s.object(7), UsageError);
  const int object = s.add_object("a");
  EXPECT_THROW(s.add_object("a"), UsageError);
  EXPECT_THROW(s.add_click(object, inside(5)), UsageError);
  s.add_click(object, inside(0));
  EXPECT_THROW(s.add_click(object, outside(0.01)), UsageError);
  EXPECT_THROW(s.take_back_click(object, 1), UsageError);
  Options<3> wrong;
  wrong.coarseness = 0;
  EXPECT_THROW(s.set_options(object, wrong), UsageError);
  EXPECT_EQ(s.object(object).clicks.size(), 1u);
  const int empty = s.add_object("b");
  EXPECT_THROW(s.propose(empty), UsageError);
  EXPECT_THROW(s.evolve(empty), UsageError);
}

TEST(Segmentation, KeepsItsFieldsWithinABound) {
  Segmentation<3> s(make_setting(phantom()), 0);
  const int object = s.add_object();
  s.add_click(object, inside(0));
  const Points<3> first = s.evolve(object).shape.points;
  Segmentation<3> roomy = ball();
  const int other = roomy.add_object();
  roomy.add_click(other, inside(0));
  EXPECT_EQ(roomy.evolve(other).shape.points, first);
  EXPECT_GT(roomy.memory_bytes(), 0u);
  EXPECT_EQ(s.memory_bytes(), 0u);
}

}  // namespace
}  // namespace surf::segment
