#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libsurf/segment/click_search.h"
#include "libsurf/segment/region_search.h"
#include "libsurf/segment/verdict.h"
#include "tests/surf/segment/ball_field.h"

namespace surf::segment {
namespace {

/// Nodes and voxels are the same here.
double radius_of(const Rung<3>& rung) {
  return std::cbrt(3 / (4 * std::numbers::pi) * double(rung.n_nodes));
}

TEST(OutwardSearch, FindsASmallObjectWithoutLookingFarAway) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(42, 55, 47), 11);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  const SearchedRegions<3> found = search_outward<3>(grid, Vector<3>(44, 53, 46));
  ASSERT_FALSE(found.found.empty());
  EXPECT_LT(field->n_asked(), 60u * 60 * 60);
  EXPECT_NEAR(radius_of(found.found.front()), 11, 0.7);
  EXPECT_TRUE(found.found.front().inside.contains({42, 55, 47}));
  EXPECT_TRUE(found.found.front().inside.contains({42, 64, 47}));
  EXPECT_FALSE(found.found.front().inside.contains({42, 68, 47}));
  for (const Rung<3>& rung : found.found) {
    const NodeBox<3> box = rung.inside.box(), region = rung.inside.bounds(0);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(region.lower[axis] - box.lower[axis], std::min(6, region.lower[axis]));
      EXPECT_EQ(box.upper()[axis] - region.upper()[axis],
                std::min(6, test::kBallFieldSize - region.upper()[axis]));
    }
  }
}

TEST(OutwardSearch, GoesOnWhereAnObjectGoesOn) {
  for (const double radius : {28, 34}) {  // beyond the first cube, beyond both
    const auto field = std::make_shared<test::BallField>(Vector<3>(50, 50, 50), radius);
    const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
    const SearchedRegions<3> found = search_outward<3>(grid, Vector<3>(52, 47, 50));
    ASSERT_FALSE(found.found.empty());
    EXPECT_NEAR(radius_of(found.found.front()), radius, 0.7);
  }
}

TEST(OutwardSearch, FindsAtTheBorderWhatEndsThere) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(0, 50, 50), 11);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  const SearchedRegions<3> found = search_outward<3>(grid, Vector<3>(4, 50, 50));
  ASSERT_FALSE(found.found.empty());
  EXPECT_NEAR(radius_of(found.found.front()) * std::cbrt(2), 11, 1);
  EXPECT_TRUE(found.found.front().inside.contains({0, 50, 50}));
}

TEST(OutwardSearch, StopsAndTellsInOrder) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(70, 70, 70), 28);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  int last = 0, n_seen = 0;
  search_outward<3>(grid, Vector<3>(70, 70, 70), {}, [&](int n, const Rung<3>* seen) {
    EXPECT_GE(n, last);
    last = n;
    if (!seen) return true;
    ++n_seen;
    for (const int node : seen->inside.bounds(0).upper()) EXPECT_GT(node, 68);  // not a cube's own
    return true;
  });
  EXPECT_GT(last, 0);
  EXPECT_GT(n_seen, 0);
  for (const int n_before : {0, 3, 30}) {
    const SearchedRegions<3> stopped = search_outward<3>(
        grid, Vector<3>(70, 70, 70), {}, [&](int n, const Rung<3>*) { return n < n_before; });
    EXPECT_TRUE(stopped.was_stopped);
    EXPECT_TRUE(stopped.found.empty() && stopped.settled.empty());
  }
  const SearchGrid<3> other(field, test::BallField::extent(), test::ball_lattice());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(
      search_outward<3>(other, Vector<3>(70, 70, 70), {}, {}, stop.get_token()).was_stopped);
  EXPECT_EQ(other.memory_bytes(), 0u);
}

TEST(OutwardSearch, LeavesOutWhatTheCubeCutsOff) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(50, 50, 50), 28);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  const NodeBox<3> box = cube_round<3>(grid, Vector<3>(50, 50, 50), 24);
  EXPECT_EQ(box.lower, (NodeBox<3>::Index{26, 26, 26}));
  EXPECT_EQ(box.size, (NodeBox<3>::Index{49, 49, 49}));
  const SearchGrid<3> cube = grid.part(box);
  EXPECT_TRUE(cube.is_cut_off({{0, 5, 5}, {3, 3, 3}}));
  EXPECT_TRUE(cube.is_cut_off({{5, 5, 46}, {3, 3, 3}}));
  EXPECT_FALSE(cube.is_cut_off({{1, 1, 1}, {47, 47, 47}}));
  EXPECT_FALSE(grid.is_cut_off({{0, 0, 0}, {100, 100, 100}}));
  const std::array seeds{Vector<3>(50, 50, 50)};
  for (const Rung<3>& rung : search_rungs<3>(cube, seeds).found)
    EXPECT_FALSE(cube.is_cut_off(rung.inside.bounds(0)));
}

/// Clicks, their regions and the verdict are the same to the bit where the nodes of all of the grid
/// have been made before, as a studio does, and where they have not.
TEST(OutwardSearch, ClicksAreTheSameInAGridThatIsNotMade) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(42, 55, 47), 11);
  const SearchGrid<3> made(*field, test::BallField::extent(), test::ball_lattice()),
      lazy(field, test::BallField::extent(), test::ball_lattice());
  std::vector<Click<3>> clicks(3);
  clicks[0].point_mm = Vector<3>(44, 53, 46);
  clicks[1].point_mm = Vector<3>(42, 64, 47);
  clicks[1].side = Side::kOutside;
  clicks[2].point_mm = Vector<3>(42, 55, 60);
  const auto a = search_clicks<3>(made, clicks), b = search_clicks<3>(lazy, clicks);
  ASSERT_TRUE(a && b && !a->found.empty());
  EXPECT_EQ(lazy.memory_bytes(), 0u);
  ASSERT_EQ(a->found.size(), b->found.size());
  for (std::size_t n = 0; n < a->found.size(); ++n) {
    EXPECT_EQ(a->found[n].inside, b->found[n].inside);
    EXPECT_EQ(a->found[n].score, b->found[n].score);
  }
  const VerdictFeatures of_made = verdict_features(made, *a), of_lazy = verdict_features(lazy, *b);
  EXPECT_EQ(of_made.separation, of_lazy.separation);
  EXPECT_EQ(of_made.consent, of_lazy.consent);
  const auto regions_a = regions(made, *a), regions_b = regions(lazy, *b);
  for (std::size_t n = 0; n < regions_a.size(); ++n) {
    EXPECT_EQ(regions_a[n].share, regions_b[n].share);
    EXPECT_EQ(regions_a[n].low, regions_b[n].low);
    EXPECT_EQ(regions_a[n].node_to_world.matrix(), regions_b[n].node_to_world.matrix());
  }
}

}  // namespace
}  // namespace surf::segment
