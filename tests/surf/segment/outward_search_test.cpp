#include "libsurf/segment/region_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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
  const auto field = std::make_shared<test::BallField>(Vector<3>(50, 50, 50), 28);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  int last = 0;
  search_outward<3>(grid, Vector<3>(50, 50, 50), {}, [&](int n, const Rung<3>* seen) {
    EXPECT_GE(n, last);
    last = n;
    EXPECT_TRUE(!seen || grid.box().contains(seen->inside.box().lower));
    return true;
  });
  EXPECT_GT(last, 0);
  EXPECT_TRUE(search_outward<3>(grid, Vector<3>(50, 50, 50), {}, [](int, const Rung<3>*) {
                return false;
              }).was_stopped);
}

}  // namespace
}  // namespace surf::segment
