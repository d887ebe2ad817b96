// What a further click changes, and what it leaves as it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "libsurf/segment/segment.h"
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

TEST(Amend, AFurtherClickLeavesTheRestAsItIs) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int object = s.add_object();
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

// As an evolution of all of it would: the rest was at its minimum already.
TEST(Amend, WhatAClickAmendsEndsWhereAllOfItWould) {
  const volume::Volume volume = phantom(volume::PhantomKind::kSeparateBalls, 0.05);
  Segmentation<3> dialogue(make_setting(volume));
  const int object = dialogue.add_object();
  dialogue.add_click(object, inside(-0.5));
  dialogue.evolve(object);
  dialogue.add_click(object, inside(0.5));
  dialogue.evolve(object);
  SegmentOptions at_once;
  at_once.seeds_mm = {{-0.5, 0, 0}, {0.5, 0, 0}};
  const double whole = make_setting(volume)->measures(segment(volume, at_once).shape).content;
  EXPECT_NEAR(dialogue.measures(object).content, whole, 0.01 * whole);
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

// A click of another object comes before the new one: what has evolved is corrected all the same.
TEST(Amend, GoesOnFromTheShapeWhateverAnotherObjectWasGiven) {
  Segmentation<3> s(make_setting(phantom(volume::PhantomKind::kSeparateBalls, 0.05)));
  const int one = s.add_object(), other = s.add_object();
  s.add_click(one, inside(-0.5));
  s.evolve(one);
  s.add_click(other, inside(0.5));
  s.add_click(one, {{-0.5, 0.9, 0}, Side::kInside});
  const Result<3>& result = s.evolve(one);
  bool is_from_shape = false;
  for (auto at = result.search; at; at = at->before) is_from_shape |= at->has_evolved;
  EXPECT_TRUE(is_from_shape);
  EXPECT_EQ(result.search->clicks.size(), 3u);
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
