#include "libsurf/segment/recipe.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stop_token>
#include <thread>

#include "libsurf/base/error.h"
#include "tests/surf/segment/dialogues.h"

namespace surf::segment {
namespace {

TEST(Recipe, IsLoadedWithoutComputing) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05));
  Segmentation<3> s(setting);
  const int object = s.add_object("two balls");
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  Options<3> options;  // other ones, so that the second evolution begins anew
  options.coarseness = 2;
  s.set_options(object, options);
  s.add_click(object, inside(0.5));
  s.evolve(object);
  const std::string recipe = to_recipe<3>(s);
  Segmentation<3> again(setting);
  load<3>(recipe, again);
  EXPECT_EQ(again.object(object).clicks.size(), 2u);
  EXPECT_FALSE(again.is_made(object));
  EXPECT_EQ(to_recipe<3>(again), recipe);
  int n_evolutions = 0;
  std::string last;
  again.make(object, [&](const std::string& stage, const auto&, const auto&) {
    n_evolutions += stage == "evolve" && last != "evolve";
    last = stage;
    return true;
  });
  EXPECT_EQ(n_evolutions, 1) << "the first one is not needed";
  EXPECT_EQ(again.object(object).result->shape.points, s.object(object).result->shape.points);
  std::string foreign = recipe;
  foreign.replace(foreign.find("-0.5"), 4, "99.5");
  Segmentation<3> fresh(setting);
  EXPECT_THROW(load<3>(foreign, fresh), InputError);
  EXPECT_TRUE(fresh.objects().empty());
}

// In the middle of a step's mending, between stages, in a correction: a recipe knows of steps only.
TEST(Recipe, RepeatsWhatWasStoppedAtWhateverMoment) {
  using std::chrono::duration;
  using std::chrono::steady_clock;
  constexpr int kMoments = 12;
  const auto setting = make_setting(phantom(volume::PhantomKind::kTorus, 0.05));
  duration<double> all{};  // from the first step to the end of the run
  int n_stopped = 0;
  for (int n = kMoments; n >= 0; --n) {  // the first one comes to its end
    Segmentation<3> s(setting);
    s.add_click(s.add_object(), inside(0.6));
    std::stop_source source;
    std::atomic<bool> has_begun = false;
    std::jthread stopper([&] {
      has_begun.wait(false);
      if (n == kMoments) return;
      std::this_thread::sleep_for(all * n / kMoments);
      source.request_stop();
    });
    steady_clock::time_point begin;
    s.evolve(
        1,
        [&](const auto&, const flow::StepRecord& record, const auto&) {
          if (record.n_elements == 0 || has_begun.exchange(true)) return true;
          begin = steady_clock::now();
          has_begun.notify_all();
          return true;
        },
        source.get_token());
    if (n == kMoments) all = steady_clock::now() - begin;
    n_stopped += s.object(1).state() == Outcome::kStopped;
    const std::string recipe = to_recipe<3>(s);
    Segmentation<3> again(setting);
    replay<3>(recipe, again);
    EXPECT_EQ(to_recipe<3>(again), recipe);
    for (int k = 0; k < 2; ++k) {
      const Result<3>&first = *s.object(1).result, &second = *again.object(1).result;
      EXPECT_EQ(second.outcome, first.outcome);
      EXPECT_EQ(second.n_steps(), first.n_steps());
      ASSERT_EQ(second.shape.points, first.shape.points) << "moment " << n << ", part " << k;
      ASSERT_EQ(second.shape.elements, first.shape.elements);
      s.evolve(1);
      again.evolve(1);
    }
  }
  EXPECT_GT(n_stopped, kMoments / 4);
}

ProgressOf<3> stopping_after(int n_steps) {
  return [n_steps, n = 0](const auto&, const flow::StepRecord& record, const auto&) mutable {
    n += record.n_elements > 0;
    return n < n_steps;
  };
}

// An evolution that begins anew after one that was stopped: the steps of the latter are not its
// own.
TEST(Recipe, MakesAgainWhatWasStoppedTwice) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kBall, 0.05));
  Segmentation<3> s(setting);
  const int object = s.add_object();
  s.add_click(object, inside(0));
  ASSERT_EQ(s.evolve(object, stopping_after(2)).outcome, Outcome::kStopped);
  s.add_click(object, outside(0.45));
  ASSERT_EQ(s.evolve(object, stopping_after(3)).outcome, Outcome::kStopped);
  ASSERT_EQ(s.object(object).result->n_steps(), 3);
  Segmentation<3> again(setting);
  load<3>(to_recipe<3>(s), again);
  const Result<3>&first = *s.object(object).result, &second = again.make(object);
  EXPECT_EQ(second.n_steps(), 3);
  EXPECT_EQ(second.shape.points, first.shape.points);
  EXPECT_EQ(to_recipe<3>(again), to_recipe<3>(s));
  EXPECT_EQ(again.evolve(object).shape.points, s.evolve(object).shape.points);
}

// With nothing before it, and with a surface whose evolution was stopped.
TEST(Recipe, RepeatsWhatWasStoppedBeforeItsFirstStep) {
  const auto setting = make_setting(phantom());
  std::stop_source stopped;
  stopped.request_stop();
  for (const bool has_surface : {false, true}) {
    Segmentation<3> s(setting);
    const int object = s.add_object();
    Options<3> options;
    options.energies = {{"minimal-surface", 1, {}}};
    s.set_options(object, options);
    s.add_click(object, inside(0));
    if (has_surface) s.evolve(object, stopping_after(2));
    ASSERT_EQ(s.evolve(object, {}, stopped.get_token()).outcome, Outcome::kStopped);
    EXPECT_EQ(s.object(object).result->shape.elements.rows() > 0, has_surface);
    Segmentation<3> again(setting), made(setting);
    replay<3>(to_recipe<3>(s), again);
    load<3>(to_recipe<3>(s), made);
    made.make(object);
    for (Segmentation<3>* each : {&again, &made}) {
      EXPECT_EQ(to_recipe<3>(*each), to_recipe<3>(s));
      EXPECT_EQ(each->object(object).state(), Outcome::kStopped);
      EXPECT_EQ(each->object(object).result->shape.points, s.object(object).result->shape.points);
    }
    const Points<3> end = s.evolve(object).shape.points;
    EXPECT_EQ(again.evolve(object).shape.points, end);
    EXPECT_EQ(made.evolve(object).shape.points, end);
  }
}

// Whether it had gone on by then or not: what goes on from there is at the level of before.
TEST(Recipe, GoesOnFromWhatWasStoppedBeforeItsFirstStepAsTheRunDid) {
  const auto setting = make_setting(phantom());
  Segmentation<3> s(setting);
  const int object = s.add_object();
  Options<3> options;
  options.energies = {{"minimal-surface", 1, {}}};
  options.n_levels = 3;
  s.set_options(object, options);
  s.add_click(object, inside(0));
  s.evolve(object,
           [](const std::string& stage, const auto&, const auto&) { return stage != "level 1"; });
  std::stop_source source;
  s.set_checkpointing({[&](const std::string&) { source.request_stop(); }, ""});
  ASSERT_EQ(s.evolve(object, {}, source.get_token()).outcome, Outcome::kStopped);
  s.set_checkpointing({});
  Segmentation<3> again(setting);
  replay<3>(to_recipe<3>(s), again);
  EXPECT_EQ(to_recipe<3>(again), to_recipe<3>(s));
  const Result<3>&first = s.evolve(object), &second = again.evolve(object);
  EXPECT_EQ(first.stages.at(1).name, "level 1");
  EXPECT_EQ(second.shape.points, first.shape.points);
  // With other options it does not go on, though the energy that is there is the one of before.
  Segmentation<3> other(setting);
  replay<3>(to_recipe<3>(again), other);
  ASSERT_TRUE(other.undo(object) && other.undo(object));
  options.energies = {{"chan-vese", 1, {}}};
  other.set_options(object, options);
  std::stop_source now;
  now.request_stop();
  other.evolve(object, {}, now.get_token());
  EXPECT_NE(other.evolve(object).stages.front().name, "go on");
  EXPECT_EQ(other.object(object).result->energies.front().name, "chan-vese");
}

TEST(Recipe, RepeatsAStopAfterALevelThatFilledTheVolume) {
  const auto setting = make_setting(phantom());
  Segmentation<3> s(setting);
  const int object = s.add_object();
  Options<3> options;
  options.energies = {{"area", 1, {}}, {"volume", -100, {}}};  // a balloon
  options.n_levels = 2;
  s.set_options(object, options);
  s.add_click(object, inside(0));
  std::stop_source source;
  s.set_checkpointing({[&](const std::string& state) {
                         if (state.find("fills") != std::string::npos) source.request_stop();
                       },
                       ""});
  const Result<3>& result = s.evolve(object, {}, source.get_token());
  ASSERT_EQ(result.outcome, Outcome::kStopped);
  ASSERT_TRUE(source.stop_requested());
  EXPECT_EQ(result.main_stage()->name, "level 1");
  s.set_checkpointing({});
  Segmentation<3> again(setting);
  replay<3>(to_recipe<3>(s), again);
  const Result<3>& second = *again.object(again.objects()[0]).result;
  EXPECT_EQ(second.main_stage()->name, "level 1");
  EXPECT_EQ(second.notes, result.notes);
  ASSERT_EQ(second.shape.points.rows(), result.shape.points.rows());
  EXPECT_EQ(second.shape.points, result.shape.points);
}

TEST(Recipe, IsLoadedWhereANameWasUsedAgain) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05));
  Segmentation<3> s(setting);
  const int first = s.add_object("liver");
  s.rename(first, "mass");
  const int second = s.add_object("liver");
  s.rename(second, "mass of the spleen");
  s.rename(second, "spleen");
  s.rename(first, "liver");
  EXPECT_TRUE(s.undo(second));
  EXPECT_THROW(s.undo(second), UsageError) << "its first name is the first object's again";
  EXPECT_TRUE(s.redo(second));
  Segmentation<3> again(setting);
  load<3>(to_recipe<3>(s), again);
  ASSERT_EQ(again.objects().size(), 2u);
  EXPECT_EQ(again.object(again.objects()[0]).name, "liver");
  EXPECT_EQ(again.object(again.objects()[1]).name, "spleen");
  EXPECT_EQ(again.first(again.objects()[1]).name, "liver (2)") << "names are unique at any time";
}

TEST(Recipe, LeavesNamesForFurtherObjects) {
  const auto setting = make_setting(phantom());
  Segmentation<3> s(setting), again(setting);
  for (int n = 0; n < 3; ++n) s.add_object();
  s.remove_object(s.objects()[0]);
  load<3>(to_recipe<3>(s), again);
  EXPECT_EQ(again.object(again.add_object()).name, "object 4");
  EXPECT_EQ(again.object(again.add_object()).name, "object 5");
}

// The second click was asked about under the first options: alone the last evolution would ask
// under the others.
TEST(Recipe, RepeatsWhatWasAskedUnderOtherOptions) {
  const auto setting = make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.1));
  Segmentation<3> s(setting), again(setting);
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  s.add_click(object, outside(-0.05));  // near the boundary, and on its side
  s.evolve(object);
  Options<3> options;
  options.coarseness = 2;
  s.set_options(object, options);
  s.add_click(object, inside(0.5));
  const Points<3> points = s.evolve(object).shape.points;
  EXPECT_TRUE(std::get<Evolve<3>>(s.history(object)[2]).is_anew);
  EXPECT_FALSE(std::get<Evolve<3>>(s.history(object).back()).is_anew);
  load<3>(to_recipe<3>(s), again);
  EXPECT_EQ(again.make(object).shape.points, points);
}

TEST(Recipe, RepeatsADialogueToTheByte) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object("two balls");
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  s.add_click(object, outside(0, 0.9));
  s.undo(object);
  s.add_click(object, inside(0.5));
  Options<3> options;
  options.coarseness = 2;
  options.flow.rel_tol = 3e-4;
  s.set_options(object, options);
  int n_steps = 0;
  s.evolve(object, [&](const std::string&, const flow::StepRecord& record, const auto&) {
    n_steps += record.n_elements > 0;
    return n_steps < 3;
  });
  const std::string recipe = to_recipe<3>(s, "balls.nii.gz");
  EXPECT_EQ(image_of_recipe(recipe), "balls.nii.gz");
  EXPECT_EQ(series_of_recipe(recipe), "");
  EXPECT_EQ(series_of_recipe(to_recipe<3>(s, "patient", "1.2.3.5")), "1.2.3.5");

  Segmentation<3> again(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  replay<3>(recipe, again);
  ASSERT_EQ(again.objects().size(), 1u);
  EXPECT_EQ(again.object(again.objects()[0]).result->shape.points,
            s.object(object).result->shape.points);
  EXPECT_EQ(to_recipe<3>(again, "balls.nii.gz"), recipe);
}

// A sample is no click: the shape need not have it, and the recipe keeps it.
TEST(Recipe, RepeatsARunFromASampleOfTheImage) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kShell)));
  const int object = s.add_object("shell");
  Options<3> options;
  options.samples_mm = {{0.45, 0, 0}};
  options.initial =
      s.setting().joined({s.setting().ball({0, 0, 0}, 0.62, 0.08),
                          s.setting().flipped(s.setting().ball({0, 0, 0}, 0.28, 0.08))});
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  s.set_options(object, options);
  const Result<3>& result = s.evolve(object);
  EXPECT_TRUE(s.object(object).clicks.empty());
  const std::string recipe = to_recipe<3>(s);
  Segmentation<3> again(make_setting(phantom(volume::PhantomKind::kShell)));
  replay<3>(recipe, again);
  EXPECT_EQ(again.object(again.objects()[0]).result->shape.points, result.shape.points);
  EXPECT_EQ(to_recipe<3>(again), recipe);
  options.samples_mm = {{99, 0, 0}};
  EXPECT_THROW(s.set_options(object, options), UsageError);
}

TEST(Recipe, IsRefusedWhereItDoesNotBelong) {
  Segmentation<3> s = ball();
  const int object = s.add_object("ball");
  s.add_click(object, inside(0));
  const std::string recipe = to_recipe<3>(s);
  Segmentation<3> other(make_setting(phantom(volume::PhantomKind::kBox)));
  EXPECT_THROW(replay<3>(recipe, other), InputError);
  std::string newer = recipe;
  newer.replace(newer.find("\"version\": 2"), 12, "\"version\": 9");
  std::string broken = recipe;
  broken.replace(broken.find("inside"), 6, "beside");
  for (const std::string& text : {newer, broken, std::string("{}"), std::string("not JSON")}) {
    Segmentation<3> fresh = ball();
    EXPECT_THROW(replay<3>(text, fresh), InputError);
    EXPECT_TRUE(fresh.objects().empty());
  }
}

}  // namespace
}  // namespace surf::segment
