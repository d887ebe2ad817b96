#include "libcurve/mesh/detail/boundary_runs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libcurve/mesh/primitives.h"

namespace surf::curve {
namespace {

BoundaryRuns runs_of(const Segments& curves) {
  return {curves, intersections(curves.points, curves.elements),
          static_cast<int>(curves.elements.rows())};
}

int n_kept(const BoundaryRuns& boundary) {
  return int(std::count_if(boundary.runs().begin(), boundary.runs().end(),
                           [](const Run& run) { return run.is_kept; }));
}

TEST(BoundaryRuns, OfACurveThatMeetsNothingIsOneLoop) {
  const Segments disc = circle({0, 0}, 1, 0.1), hole = flipped(disc);
  const BoundaryRuns boundary = runs_of(disc);
  ASSERT_EQ(boundary.runs().size(), 1u);
  EXPECT_TRUE(boundary.runs()[0].is_loop && boundary.runs()[0].is_kept);
  EXPECT_EQ(boundary.next(0), 0);
  EXPECT_FALSE(runs_of(hole).runs()[0].is_kept);  // it bounds nothing
}

TEST(BoundaryRuns, OfTwoDiscsThatOverlapKeepTheOuterArcsWhichFollowEachOther) {
  const Segments discs = joined({circle({0, 0}, 1, 0.1), circle({1, 0}, 1, 0.1)});
  const BoundaryRuns boundary = runs_of(discs);
  ASSERT_EQ(boundary.runs().size(), 4u);
  EXPECT_EQ(n_kept(boundary), 2);
  for (int r = 0; r < 4; ++r) {
    if (!boundary.runs()[r].is_kept) continue;
    EXPECT_NE(boundary.next(r), r);
    EXPECT_EQ(boundary.next(boundary.next(r)), r);
    EXPECT_FALSE(boundary.is_cut(r));
  }
}

TEST(BoundaryRuns, WhereCornersTouchCutAllButTheWidest) {
  Points<2> large(4, 2), small(3, 2);
  large << 0, 0, 4, -4, 8, 0, 4, 4;
  small << 0, 0, -4, 1, -4, -1;
  const Segments curves = joined({polygon(large, 100), polygon(small, 100)});
  const BoundaryRuns boundary = runs_of(curves);
  ASSERT_EQ(n_kept(boundary), 2);
  int n_cut = 0;
  for (int r = 0; r < int(boundary.runs().size()); ++r) {
    EXPECT_EQ(boundary.next(r), r);  // each corner is closed by itself
    n_cut += boundary.is_cut(r);
    if (boundary.is_cut(r)) {
      const Vector<2> first =
          boundary.graph().rounded(boundary.piece(boundary.runs()[r].pieces[0]).to);
      EXPECT_LT(first[0], 0);  // the small triangle's
    }
  }
  EXPECT_EQ(n_cut, 1);
}

}  // namespace
}  // namespace surf::curve
