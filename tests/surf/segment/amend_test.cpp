// What a further click changes, and what it leaves as it is.
#include "libsurf/segment/detail/amend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "libsurf/segment/segment.h"
#include "tests/surf/segment/ball_field.h"
#include "tests/surf/segment/dialogues.h"

namespace surf::segment {
namespace {

/// How many vertices of a surface are those of another, bit for bit.
int n_kept(const Triangles& surface, const Triangles& of) {
  std::set<std::array<double, 3>> places;
  for (const auto& x : of.points.rowwise()) places.insert({x[0], x[1], x[2]});
  int n = 0;
  for (const auto& x : surface.points.rowwise()) n += places.contains({x[0], x[1], x[2]});
  return n;
}

bool has_stage(const Result<3>& result, const std::string& name) {
  return std::any_of(result.stages.begin(), result.stages.end(),
                     [&](const StageReport& stage) { return stage.name == name; });
}

/// So that a ball of the phantom has more triangles than evolve anew.
Options<3> fine() {
  Options<3> out;
  out.edge_length_mm = 0.016;
  out.coarseness = 1;
  return out;
}

TEST(Amend, AFurtherClickLeavesTheRestOfALargeSurfaceAsItIs) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object();
  s.set_options(object, fine());
  const double ball_volume = 4 * std::numbers::pi / 3 * std::pow(0.3, 3);
  s.add_click(object, inside(-0.5));
  const Triangles one = s.evolve(object).shape;
  EXPECT_NEAR(s.measures(object).content, ball_volume, 0.03 * ball_volume);
  s.add_click(object, inside(0.5));
  const Result<3>& two = s.evolve(object);
  EXPECT_TRUE(has_stage(two, "amend"));
  EXPECT_FALSE(has_stage(two, "fit"));
  EXPECT_TRUE(s.measures(object).passed);
  EXPECT_EQ(s.measures(object).n_components, 2);
  EXPECT_NEAR(s.measures(object).content, 2 * ball_volume, 0.06 * ball_volume);
  EXPECT_EQ(n_kept(one, two.shape), one.points.rows());
  ASSERT_TRUE(two.certainty);
  EXPECT_EQ(two.certainty->deviation_mm.size(), two.shape.points.rows());
}

// In the noise, far from the object.
TEST(Amend, AClickOfWhichNothingIsLeftLeavesAllOfALargeSurface) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object();
  s.set_options(object, fine());
  s.add_click(object, inside(-0.5));
  const Result<3> one = s.evolve(object);
  ASSERT_TRUE(is_amended<3>(one.shape));
  s.add_click(object, inside(0, 0.85));
  const Result<3>& two = s.evolve(object);
  EXPECT_TRUE(has_stage(two, "amend"));
  EXPECT_EQ(two.outcome, Outcome::kConverged);
  EXPECT_EQ(two.shape.points.rows(), one.shape.points.rows());
  EXPECT_EQ(n_kept(one.shape, two.shape), one.shape.points.rows());
  ASSERT_TRUE(two.certainty);
  EXPECT_EQ(two.certainty->share_without_edge, one.certainty->share_without_edge);
}

TEST(Amend, IsNotForgottenByAStopBeforeTheFirstStep) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object();
  s.set_options(object, fine());
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  s.add_click(object, inside(0.5));
  std::stop_source stopped;
  stopped.request_stop();
  ASSERT_EQ(s.evolve(object, {}, stopped.get_token()).outcome, Outcome::kStopped);
  EXPECT_TRUE(has_stage(s.evolve(object), "amend"));
}

/// A ball of nodes that loses a layer all round.
struct LayeredChange {
  SearchGrid<3> grid{test::BallField({0, 0, 0}, 0.5), test::BallField::extent(),
                     test::ball_lattice()};
  NodeSet<3> before = ball({20, 20, 20}, 12), layer = before & before.complement().dilated(1),
             after = before - layer;

  NodeSet<3> ball(const std::array<int, 3>& center, double radius) const {
    NodeSet<3> out(grid.box());
    out.insert(center);
    return out.dilated(radius);
  }
  NodeSet<3> counts(std::vector<Click<3>> clicks = {}) const {
    const Triangles shape;
    return change_that_counts<3>(grid, {shape, 0, before, after, std::move(clicks)});
  }
};

// Least cuts settle all of an object's boundary: with the layer the whole inside of a skull was
// joined to itself, and evolved and was located again.
TEST(Amend, OfALayerAllRoundNothingCounts) {
  const LayeredChange change;
  EXPECT_GT(change.layer.count(), 1000u);
  EXPECT_TRUE(change.counts().is_empty());
}

TEST(Amend, ADentCountsWithWhatIsNearIt) {
  LayeredChange change;
  const NodeSet<3> dent = change.ball({32, 20, 20}, 5) & change.before;
  change.after -= dent;
  const NodeSet<3> counts = change.counts();
  EXPECT_GT(counts.count_in_both(dent), dent.count() * 9 / 10);
  EXPECT_TRUE((counts - dent.dilated(3)).is_empty());
  EXPECT_GT((change.layer - counts).count(), change.layer.count() / 2);
}

TEST(Amend, AThinChangeCountsWhereAClickIs) {
  const LayeredChange change;
  Click<3> click;
  click.side = Side::kOutside;
  click.point_mm = change.grid.node_to_world() * Vector<3>(32, 20, 20);
  const NodeSet<3> counts = change.counts({click});
  EXPECT_TRUE(counts.contains({32, 20, 20}));
  EXPECT_TRUE((counts - change.ball({32, 20, 20}, 2)).is_empty());
}

// As an evolution of all of it would: the rest was at its minimum already.
TEST(Amend, WhatAClickAmendsEndsWhereAllOfItWould) {
  const volume::Volume volume = phantom(volume::PhantomKind::kSeparateBalls, 0.05);
  Segmentation<3> dialogue(make_setting(volume));
  const int object = dialogue.add_object();
  dialogue.set_options(object, fine());
  dialogue.add_click(object, inside(-0.5));
  dialogue.evolve(object);
  dialogue.add_click(object, inside(0.5));
  EXPECT_TRUE(has_stage(dialogue.evolve(object), "amend"));
  SegmentOptions at_once = fine();
  at_once.seeds_mm = {{-0.5, 0, 0}, {0.5, 0, 0}};
  const double whole = make_setting(volume)->measures(segment(volume, at_once).shape).content;
  EXPECT_NEAR(dialogue.measures(object).content, whole, 0.01 * whole);
}

TEST(Amend, OfASmallSurfaceEndsAsAllClicksAtOnce) {
  const volume::Volume volume = phantom(volume::PhantomKind::kSeparateBalls, 0.05);
  Segmentation<3> dialogue(make_setting(volume)), at_once(make_setting(volume));
  const int object = dialogue.add_object(), other = at_once.add_object();
  dialogue.add_click(object, inside(-0.5));
  dialogue.evolve(object);
  dialogue.add_click(object, inside(0.5));
  at_once.add_click(other, inside(-0.5));
  at_once.add_click(other, inside(0.5));
  const Result<3>&one = dialogue.evolve(object), &two = at_once.evolve(other);
  EXPECT_EQ(one.shape.points, two.shape.points);
  EXPECT_EQ(one.shape.elements, two.shape.elements);
}

TEST(Amend, IsTheSameAfterProposalsWereLookedAt) {
  std::vector<Triangles> ends;
  for (const bool is_looked_at : {false, true}) {
    Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
    const int object = s.add_object();
    s.add_click(object, inside(-0.5));
    s.evolve(object);
    s.add_click(object, inside(0.5));
    if (is_looked_at) s.propose(object);
    ends.push_back(s.evolve(object).shape);
  }
  EXPECT_EQ(ends[0].points, ends[1].points);
  EXPECT_EQ(ends[0].elements, ends[1].elements);
}

/// Whether `search` goes on from one that holds for `is_it`.
template <class IsIt>
bool goes_on_from(ClickSearchPointer<3> search, const IsIt& is_it) {
  for (; search; search = search->before)
    if (is_it(search)) return true;
  return false;
}

// A click of another object comes before the new one: what was found is corrected all the same.
TEST(Amend, GoesOnFromWhatWasFoundWhateverAnotherObjectWasGiven) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int one = s.add_object(), other = s.add_object();
  s.add_click(one, inside(-0.5));
  const ClickSearchPointer<3> found = s.evolve(one).search;
  s.add_click(other, inside(0.5));
  s.add_click(one, {{-0.5, 0.9, 0}, Side::kInside});
  const Result<3>& result = s.evolve(one);
  EXPECT_TRUE(goes_on_from(result.search, [&](const auto& search) { return search == found; }));
  EXPECT_EQ(result.search->clicks.size(), 3u);
}

TEST(Amend, AClickThatTheRegionHasOnItsSideSpeaksOfTheShape) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.1)));
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  const Result<3>& first = s.evolve(object);
  const NodeSet<3> region = first.search->inside();
  const ImageExtent<3>& extent = s.setting().extent();
  ASSERT_EQ(region.box().size, extent.size);  // nodes are voxels
  // Outside the region, but in the shape that has evolved from it.
  std::optional<Vector<3>> wrong;
  for (std::size_t n = 0; n < region.box().n() && !wrong; ++n) {
    const auto node = region.box().node(n);
    const Vector<3> point = extent.index_to_world * Vector<3>(node[0], node[1], node[2]);
    if (!region.contains(node) &&
        mesh::are_inside<3>(first.shape, Points<3>(point.transpose())).front() != 0)
      wrong = point;
  }
  ASSERT_TRUE(wrong);
  const auto has_evolved = [](const auto& search) { return search->has_evolved; };
  s.add_click(object, {*wrong, Side::kOutside});
  const Result<3>& second = s.evolve(object);
  EXPECT_TRUE(goes_on_from(second.search, has_evolved));
  const Triangles in_dialogue = second.shape;
  s.take_back_click(object, 1);
  s.evolve(object);
  s.add_click(object, outside(-0.65));
  EXPECT_FALSE(goes_on_from(s.evolve(object).search, has_evolved));
  // So it does where nothing was asked for between the clicks.
  const int other = s.add_object();
  s.take_back_click(object, 1);
  s.take_back_click(object, 0);
  s.add_click(other, inside(-0.5));
  s.add_click(other, {*wrong, Side::kOutside});
  const Result<3>& at_once = s.evolve(other);
  EXPECT_TRUE(goes_on_from(at_once.search, has_evolved));
  EXPECT_EQ(at_once.shape.points, in_dialogue.points);
  EXPECT_EQ(at_once.shape.elements, in_dialogue.elements);
  // And where no field is kept: the evolution between the clicks drops the grid of the search.
  Segmentation<3> bounded(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.1)), 0);
  const int same = bounded.add_object();
  bounded.add_click(same, inside(-0.5));
  bounded.add_click(same, {*wrong, Side::kOutside});
  EXPECT_EQ(bounded.evolve(same).shape.points, in_dialogue.points);
}

// Nobody has seen a shape that a stroke, or a click of another object, could answer; and what is
// far from a region's boundary no evolution moves.
TEST(Amend, WhatAnswersNoEvolutionAsksForNone) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.1)));
  const int object = s.add_object(), other = s.add_object();
  s.add_click(object, inside(-0.5));
  s.add_click(object, inside(-0.49));
  s.add_click(object, {{-0.5, 0, 0.28}, Side::kInside, {{-0.5, 0, 0.28}, {-0.5, 0, 0.27}}});
  s.add_click(other, inside(-0.5 + 0.33));
  int n_steps = 0;
  s.propose(object, [&](const auto&, const flow::StepRecord& record, const auto&) {
    n_steps += record.n_elements > 0;
    return true;
  });
  const auto has_evolved = [](const auto& search) { return search->has_evolved; };
  EXPECT_FALSE(goes_on_from(s.object(object).result->search, has_evolved));
  EXPECT_EQ(s.object(object).result->search->clicks.size(), 4u);
  EXPECT_EQ(n_steps, 0);
}

// Such a click leaves a dialogue's shape as it is; the region goes on from itself.
TEST(Amend, AClickThatTheShapeHasOnItsSideChangesNoRegion) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.1)));
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  const Result<3>& first = s.evolve(object);
  const Triangles shape = first.shape;
  s.add_click(object, outside(-0.5 + 0.45));
  EXPECT_EQ(s.evolve(object).shape.points, shape.points);
  s.add_click(object, inside(0.5));
  const auto has_evolved = [](const auto& search) { return search->has_evolved; };
  EXPECT_FALSE(goes_on_from(s.propose(object).search, has_evolved));
}

// At the rim of the cavity of a shell: what the click adds closes the cavity but for a pinhole.
TEST(Amend, AClickThatLeavesNoSoundBoundaryLeavesTheRegion) {
  volume::PhantomOptions options;
  options.kind = volume::PhantomKind::kShell;
  options.size = {48, 48, 48};
  options.spacing_mm = Eigen::Vector3d::Ones();
  Segmentation<3> s(make_setting(volume::make_phantom(options)));
  const int object = s.add_object();
  s.add_click(object, {{-5.223, -4.724, -9.377}, Side::kInside});
  s.add_click(object, {{-2.718, 2.687, 1.504}, Side::kOutside});
  const NodeSet<3> region = s.propose(object).search->inside();
  s.add_click(object, {{0, 0, 6}, Side::kInside});
  const Result<3>& result = s.propose(object);
  EXPECT_EQ(result.outcome, Outcome::kProposed) << result.message;
  EXPECT_EQ(result.search->inside(), region);
  EXPECT_EQ(result.search->clicks.size(), 3u);
}

// Nothing between the cavity and the outside of a shell can be taken and left.
TEST(Amend, WhatDoesNotObeyAClickIsDoubtful) {
  volume::PhantomOptions options;
  options.kind = volume::PhantomKind::kShell;
  options.size = {48, 48, 48};
  options.spacing_mm = Eigen::Vector3d::Ones();
  Segmentation<3> s(make_setting(volume::make_phantom(options)));
  const int object = s.add_object();
  s.add_click(object, {{-5.223, -4.724, -9.377}, Side::kInside});
  s.add_click(object, {{-2.718, 2.687, 1.504}, Side::kOutside});
  s.add_click(object, {{0, 0, 5}, Side::kInside});
  const Result<3>& result = s.evolve(object);
  ASSERT_TRUE(result.verdict);
  ASSERT_TRUE(std::any_of(result.notes.begin(), result.notes.end(), [](const std::string& note) {
    return note.find("is not obeyed") != std::string::npos;
  }));
  EXPECT_EQ(result.verdict->trust, Trust::kDoubtful);
  EXPECT_EQ(result.verdict->words(), "a click is not obeyed");
  // That of the region, which goes with it, says nothing of what a surface did.
  ASSERT_TRUE(result.verdict_of_region);
  EXPECT_GT(result.verdict_of_region->n_cases, 0);
  EXPECT_LT((result.verdict->place_mm - Vector<3>(-2.718, 2.687, 1.504)).norm(), 1e-9);
}

// Its options have changed since: nothing is kept.
TEST(Amend, OtherOptionsEvolveAllOfIt) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object();
  s.add_click(object, inside(-0.5));
  s.evolve(object);
  Options<3> options;
  options.edge_length_mm = 0.1;
  s.set_options(object, options);
  s.add_click(object, inside(0.5));
  EXPECT_TRUE(has_stage(s.evolve(object), "fit"));
}

}  // namespace
}  // namespace surf::segment
