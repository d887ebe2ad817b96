// Undo, redo, and what they bring back or make again.
#include "libsurf/segment/history.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segmentation.h"
#include "tests/surf/segment/dialogues.h"

namespace surf::segment {
namespace {

TEST(History, UndoesAndRedoesWithoutComputing) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  EXPECT_FALSE(s.undo(object));
  s.add_click(object, inside(0));
  s.evolve(object);
  const auto shape = s.object(object).result;
  s.add_click(object, outside(0.9));
  EXPECT_TRUE(s.undo(object));
  EXPECT_EQ(s.object(object).clicks.size(), 1u);
  EXPECT_TRUE(s.undo(object));
  EXPECT_EQ(s.object(object).state(), Outcome::kEmpty);
  EXPECT_TRUE(s.redo(object));
  EXPECT_EQ(s.object(object).result, shape);
  s.take_back_click(object, 0);  // what was undone is gone
  EXPECT_FALSE(s.redo(object));
}

TEST(History, KeepsWhatCanBeRedoneWhereAStopKeepsNothing) {
  Segmentation<3> s = ball();
  const int object = s.add_object();
  s.add_click(object, inside(0));
  s.rename(object, "ball");
  s.undo(object);
  std::stop_source source;
  const ProgressOf<3> stops = [&](const std::string&, const auto&, const auto&) {
    source.request_stop();
    return true;
  };
  s.evolve(object, stops, source.get_token(), [] { return false; });
  EXPECT_EQ(s.history(object).size(), 1u);
  EXPECT_EQ(s.object(object).state(), Outcome::kEmpty);
  EXPECT_TRUE(s.can_redo(object));
  s.evolve(object, stops, source.get_token(), [] { return true; });
  EXPECT_EQ(s.history(object).size(), 2u);
  EXPECT_EQ(s.object(object).state(), Outcome::kStopped);
}

TEST(History, RedoesWhatWasUndoneBeforeAnEvolutionThatKeepsIt) {
  Segmentation<3> s = ball(), other = ball();
  for (Segmentation<3>* each : {&s, &other}) {
    each->add_click(each->add_object(), inside(0));
    each->add_click(1, inside(0.1));
    each->evolve(1);
  }
  s.undo(1);
  s.undo(1);
  s.evolve(1, {}, {}, {}, true);
  EXPECT_EQ(s.history(1).size(), 2u);
  ASSERT_NE(s.undone(1), nullptr);
  EXPECT_TRUE(std::holds_alternative<AddClick<3>>(*s.undone(1)));
  s.undo(1);  // and the other way round
  EXPECT_TRUE(s.redo(1));
  EXPECT_TRUE(s.redo(1));
  EXPECT_TRUE(s.redo(1));
  EXPECT_FALSE(s.can_redo(1));
  EXPECT_EQ(s.history(1).size(), 3u);  // the evolution between is gone
  EXPECT_EQ(s.object(1).result->shape.points, other.object(1).result->shape.points);
  s.undo(1);
  s.undo(1);
  s.evolve(1, {}, {}, {}, true);
  s.add_click(1, inside(-0.1));  // what was undone is gone, and the evolution is one of all others
  s.undo(1);
  EXPECT_TRUE(s.redo(1));
  EXPECT_EQ(s.history(1).size(), 3u);
  s.undo(1);
  s.undo(1);
  s.evolve(1);
  EXPECT_FALSE(s.can_redo(1));
}

TEST(History, KeepsTheEvolutionBeforeANameThatCannotBeRedone) {
  Segmentation<3> s = ball();
  const int object = s.add_object("a");
  s.add_click(object, inside(0));
  s.rename(object, "b");
  s.undo(object);
  const int other = s.add_object("b");
  s.evolve(object, {}, {}, {}, true);
  const auto result = s.object(object).result;
  EXPECT_THROW(s.redo(object), UsageError);
  EXPECT_EQ(s.object(object).result, result);
  EXPECT_EQ(s.history(object).size(), 2u);
  s.rename(other, "c");
  EXPECT_TRUE(s.redo(object));
  EXPECT_EQ(s.object(object).name, "b");
}

TEST(History, BringsBackWhatWasSetAside) {
  Segmentation<3> s = ball();
  const int object = s.add_object("a"), other = s.add_object("b");
  s.add_click(object, inside(0));
  s.evolve(object);
  s.add_click(object, outside(0.9));
  s.undo(object);
  const auto result = s.object(object).result;
  const std::string recipe = to_recipe<3>(s);
  s.set_aside(object);
  EXPECT_EQ(s.objects(), std::vector{other});
  EXPECT_THROW(s.object(object), UsageError);
  EXPECT_THROW(s.set_aside(object), UsageError);
  s.rename(other, "a");
  EXPECT_THROW(s.bring_back(object), UsageError);  // its name is taken
  s.undo(other);
  s.bring_back(object);
  EXPECT_THROW(s.bring_back(object), UsageError);
  EXPECT_EQ(s.objects(), (std::vector{object, other}));
  EXPECT_EQ(s.object(object).result, result);
  EXPECT_EQ(to_recipe<3>(s), recipe);
  EXPECT_TRUE(s.redo(object));
  EXPECT_EQ(s.object(object).clicks.size(), 2u);
}

// Where no memory is left for the past, what was set aside is dropped and made again.
TEST(History, MakesAgainWhatWasSetAside) {
  Segmentation<3> s(make_setting(phantom()), std::size_t(1) << 30, 0);
  const int object = s.add_object(), other = s.add_object();
  s.add_click(object, inside(0));
  const Points<3> points = s.evolve(object).shape.points;
  s.set_aside(object);
  s.add_click(other, inside(0.1));
  s.evolve(other);
  s.remove_object(other);
  s.bring_back(object);
  EXPECT_FALSE(s.is_made(object));
  EXPECT_EQ(s.make(object).shape.points, points);
}

// One of them goes on with the search before it, so that more than the last evolution is repeated.
TEST(History, MakesResultsOfThePastAgain) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05));
  Segmentation<3> kept(setting), bounded(setting, std::size_t(1) << 30, 0);
  for (Segmentation<3>* s : {&kept, &bounded}) {
    const int object = s->add_object();
    s->add_click(object, inside(-0.5));
    s->evolve(object);
    Options<3> options;
    options.components.fill_cavities = true;
    s->set_options(object, options);
    s->evolve(object);
    s->add_click(object, inside(0.5));
    s->evolve(object);
    EXPECT_TRUE(s->is_made(object));
  }
  const int object = kept.objects()[0];
  for (int n = 1; n <= 6; ++n) {
    kept.undo(object);
    bounded.undo(object);
    EXPECT_TRUE(kept.is_made(object));
    EXPECT_EQ(bounded.is_made(object), n >= 5) << n;  // where there is none yet
  }
  for (int n = 1; n <= 6; ++n) {
    kept.redo(object);
    bounded.redo(object);
    EXPECT_EQ(bounded.object(object).clicks.size(), kept.object(object).clicks.size());
    const Result<3>& made = bounded.make(object);
    EXPECT_TRUE(bounded.is_made(object));
    EXPECT_EQ(made.shape.points, kept.object(object).result->shape.points) << n;
    EXPECT_EQ(made.notes, kept.object(object).result->notes);
    EXPECT_EQ(made.proposals.size(), kept.object(object).result->proposals.size());
  }
}

TEST(History, LeavesWhatIsToBeMadeAsItIsAfterAStop) {
  Segmentation<3> s(make_setting(phantom()), std::size_t(1) << 30, 0);
  const int object = s.add_object();
  s.add_click(object, inside(0));
  const Points<3> points = s.evolve(object).shape.points;
  Options<3> options;
  options.edge_length_mm = 0.2;
  s.set_options(object, options);
  s.evolve(object);
  s.undo(object);
  ASSERT_FALSE(s.is_made(object));
  const std::string recipe = to_recipe<3>(s);
  s.make(object, [](const auto&, const auto&, const auto&) { return false; });
  EXPECT_FALSE(s.is_made(object));
  std::stop_source stopped;
  stopped.request_stop();
  s.make(object, {}, stopped.get_token());
  EXPECT_FALSE(s.is_made(object));
  EXPECT_EQ(to_recipe<3>(s), recipe);
  EXPECT_EQ(s.make(object).shape.points, points);
  EXPECT_TRUE(s.redo(object));
}

// A choice is in all that comes after it.
TEST(History, MakesWhatCameAfterAChoiceAgain) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kShell)), std::size_t(1) << 30, 0);
  const int object = s.add_object();
  s.add_click(object, inside(0.45));
  const std::size_t n = s.propose(object).proposals.size();
  s.choose(object, n - 1);
  s.add_click(object, outside(0));
  const Points<3> points = s.evolve(object).shape.points;
  s.add_click(object, outside(0.9));
  s.recolour(object, {1, 2, 3});
  Options<3> options;
  options.coarseness = 2;
  s.set_options(object, options);
  s.evolve(object);
  for (int k = 0; k < 3; ++k) s.undo(object);
  ASSERT_FALSE(s.is_made(object));
  EXPECT_EQ(s.make(object).shape.points, points);
}

}  // namespace
}  // namespace surf::segment
