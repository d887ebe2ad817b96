#include "libsurf/mesh/detail/removal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libsurf/mesh/detail/grown_part.h"
#include "libsurf/mesh/detail/rims.h"
#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr double kEdge = 0.1, kResolution = 0.05;

int top_of(const ConnectedSurface& surface) {
  int top = 0;
  for (int t = 1; t < surface.n_triangles(); ++t)
    if (surface.centroid(t)[2] > surface.centroid(top)[2]) top = t;
  return top;
}

/// What goes for the triangles within a reach of the top.
struct RemovalAtTheTop {
  const ConnectedSurface surface;
  const std::vector<int> near;
  const CubicGrid grid;
  GridCells cells;
  RemovedTriangles removal;

  RemovalAtTheTop(const Triangles& triangles, double reach)
      : surface(to_mesh(triangles)),
        near(neighbourhood(surface, {top_of(surface)}, reach)),
        grid(grid_round(surface, near, kResolution).value()),
        cells(grid) {
    for (const int t : near) cells.set_at(surface.triangles, t);
    cells.dilate(1);
    removal = choose_removal(surface, grid, near, cells);
  }
};

TEST(Neighbourhood, AreTheTrianglesOfACapWithinTheReach) {
  constexpr double kReach = 0.45;
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, kEdge)));
  const int top = top_of(surface);
  std::vector<int> found = neighbourhood(surface, {top}, kReach);
  std::sort(found.begin(), found.end());
  std::vector<int> expected;
  for (int t = 0; t < surface.n_triangles(); ++t)
    if ((surface.centroid(t) - surface.centroid(top)).norm() <= kReach) expected.push_back(t);
  EXPECT_EQ(found, expected);
}

TEST(Neighbourhood, DoesNotLeapToASheetThatIsNear) {
  const Triangles lower = ball({0, 0, 0}, 1, kEdge), upper = ball({0, 0, 2.1}, 1, kEdge);
  const ConnectedSurface surface(to_mesh(joined({lower, upper})));
  int pole = 0;
  for (int t = 0; t < lower.elements.rows(); ++t)
    if (surface.centroid(t)[2] > surface.centroid(pole)[2]) pole = t;
  for (const int t : neighbourhood(surface, {pole}, 0.5)) EXPECT_LT(t, lower.elements.rows());
}

TEST(Neighbourhood, IsTheWholeComponentWithoutAReach) {
  const Triangles first = ball({0, 0, 0}, 1, 0.2), second = ball({3, 0, 0}, 1, 0.3);
  const ConnectedSurface surface(to_mesh(joined({first, second})));
  std::vector<int> found = neighbourhood(surface, {int(first.elements.rows())});
  std::sort(found.begin(), found.end());
  ASSERT_EQ(found.size(), std::size_t(second.elements.rows()));
  EXPECT_EQ(found.front(), first.elements.rows());
}

TEST(Removal, HasAllInTheCellsAndOneSimpleRim) {
  const RemovalAtTheTop r(ball({0, 0, 0}, 1, kEdge), 0.4);
  for (const int t : r.near) EXPECT_TRUE(r.removal.is_removed[t]);
  for (int t = 0; t < r.surface.n_triangles(); ++t)
    EXPECT_TRUE(!r.cells.is_any_at(r.surface.triangles, t) || r.removal.is_removed[t]);
  const auto found = rims(free_sides(r.surface, r.removal.is_removed));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->size(), 1u);
  EXPECT_LT(r.removal.met.size(), std::size_t(r.surface.n_triangles() / 2));
}

TEST(Removal, HasACoreThatSharesNoVertexWithWhatStays) {
  const RemovalAtTheTop r(ball({0, 0, 0}, 1, kEdge), 0.4);
  std::vector<char> stays(r.surface.n_vertices(), 0);
  for (int t = 0; t < r.surface.n_triangles(); ++t)
    for (int i = 0; !r.removal.is_removed[t] && i < 3; ++i) stays[r.surface.vertex(t, i)] = 1;
  const std::set<int> core(r.removal.core.begin(), r.removal.core.end());
  for (int t = 0; t < r.surface.n_triangles(); ++t) {
    const bool is_apart = !stays[r.surface.vertex(t, 0)] && !stays[r.surface.vertex(t, 1)] &&
                          !stays[r.surface.vertex(t, 2)];
    EXPECT_EQ(core.contains(t), is_apart && r.removal.is_removed[t]);
  }
  EXPECT_FALSE(core.empty());
}

/// A ring round the top, with a few triangles left in the middle of it.
TEST(Removal, LeavesNoIslands) {
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, kEdge)));
  const int top = top_of(surface);
  std::vector<int> near;
  for (const int t : neighbourhood(surface, {top}, 0.7))
    if ((surface.centroid(t) - surface.centroid(top)).norm() > 0.25) near.push_back(t);
  const CubicGrid grid = grid_round(surface, near, kResolution).value();
  const RemovedTriangles removal = choose_removal(surface, grid, near, GridCells(grid));
  EXPECT_TRUE(removal.is_removed[top]);
  EXPECT_EQ(rims(free_sides(surface, removal.is_removed)).value().size(), 1u);
}

/// Two patches on a ball, a chain of triangles apart: removed as one, in cells that are two.
TEST(Removal, GetsABridgeWhereItHangsTogetherAndTheCellsDoNot) {
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, kEdge)));
  const int top = top_of(surface);
  std::vector<int> near = neighbourhood(surface, {top}, 0.3);
  const std::vector<int> apart = near;
  for (int t = 0; t < surface.n_triangles(); ++t) {
    const Vector<3> x = surface.centroid(t) - surface.centroid(top);
    if (x.norm() < 0.9 && x.norm() > 0.52 && x[0] > 0.3) near.push_back(t);
  }
  ASSERT_GT(near.size(), apart.size() + 10);
  const CubicGrid grid = grid_round(surface, near, kResolution).value();
  const GridCells none(grid);
  std::size_t n_before = near.size();
  const bool has_bridges = add_bridges(surface, choose_removal(surface, grid, near, none), near);
  EXPECT_TRUE(has_bridges);
  EXPECT_GT(near.size(), n_before);
  // In the end cells and removal agree.
  for (int round = 0; round < 5; ++round)
    if (!add_bridges(surface, choose_removal(surface, grid, near, none), near)) return;
  FAIL() << "bridges without end";
}

TEST(Removal, NeedsNoBridgeInOnePiece) {
  const RemovalAtTheTop r(ball({0, 0, 0}, 1, kEdge), 0.4);
  std::vector<int> near = r.near;
  EXPECT_FALSE(add_bridges(r.surface, r.removal, near));
  EXPECT_EQ(near, r.near);
}

/// A chain of triangles is as narrow as can be; a disc has no narrow part.
TEST(Removal, GetsNecksWhereItsCoreIsAnEdgeWide) {
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, kEdge)));
  const int top = top_of(surface);
  const std::vector<int> pair = {top, surface.across(top, 0)};
  std::vector<int> near;
  EXPECT_TRUE(add_necks(surface, pair, near));
  EXPECT_EQ(std::set<int>(near.begin(), near.end()), std::set<int>(pair.begin(), pair.end()));
  EXPECT_FALSE(add_necks(surface, pair, near));
  near.clear();
  EXPECT_FALSE(add_necks(surface, {top}, near));
}

TEST(Removal, LargePartsAreKnownToBoundBetweenEventsAlone) {
  const Triangles left = ball({-0.6, 0, 0}, 1, kEdge / 2), right = ball({0.6, 0, 0}, 1, kEdge / 2);
  const ConnectedSurface surface(to_mesh(joined({left, right})));
  TriangleFlags is_event(surface.n_triangles(), 0);
  for (int t = 0; t < surface.n_triangles(); ++t)
    is_event[t] = std::abs(surface.centroid(t)[0]) < 0.2;
  LargeParts large(surface, is_event);
  int n_known = 0;
  for (int t = 0; t < surface.n_triangles(); ++t) {
    const Vector<3> x = surface.centroid(t);
    const bool is_outer =
        std::min((x - Vector<3>(-0.6, 0, 0)).norm(), (x - Vector<3>(0.6, 0, 0)).norm()) > 0.9;
    EXPECT_FALSE(large.are_known_to_bound(t) && (is_event[t] || !is_outer));
    n_known += large.are_known_to_bound(t);
  }
  EXPECT_GT(n_known, 4000);
}

/// Two balls that overlap: the lens between the two circles is inside the domain.
TEST(Removal, TakesPhantomPartsAndTheirEventsAreWanted) {
  const ConnectedSurface surface(
      to_mesh(joined({ball({-0.6, 0, 0}, 1, kEdge), ball({0.6, 0, 0}, 1, kEdge)})));
  const auto is_phantom = [&](int t) {
    const Vector<3> x = surface.centroid(t);
    const double to_left = (x - Vector<3>(-0.6, 0, 0)).norm(),
                 to_right = (x - Vector<3>(0.6, 0, 0)).norm();
    return std::min(to_left, to_right) < 0.9;
  };
  TriangleFlags is_removed(surface.n_triangles(), 0), is_event(surface.n_triangles(), 0);
  int n_phantom = 0;
  for (int t = 0; t < surface.n_triangles(); ++t) {
    is_removed[t] = std::abs(surface.centroid(t)[0]) < 0.2;
    n_phantom += is_phantom(t);
  }
  ASSERT_GT(n_phantom, 50);
  is_event = is_removed;  // of this region, as all that intersects is
  TriangleFlags removed = is_removed;
  LargeParts large(surface, is_event);
  EXPECT_TRUE(remove_phantom_parts(surface, large, is_event, removed).empty());
  for (int t = 0; t < surface.n_triangles(); ++t) {
    EXPECT_TRUE(removed[t] || !is_phantom(t));
    EXPECT_TRUE(!removed[t] || std::abs(surface.centroid(t)[0]) < 0.8);
  }
  // An event of another region in the lens stops the part and is asked for.
  int in_lens = -1;
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (is_phantom(t) && !is_removed[t] &&
        (in_lens < 0 || surface.centroid(t)[0] > surface.centroid(in_lens)[0]))
      in_lens = t;
  ASSERT_GE(in_lens, 0);
  is_event[in_lens] = 1;
  removed = is_removed;
  const std::vector<int> wanted = remove_phantom_parts(surface, large, is_event, removed);
  EXPECT_EQ(std::set<int>(wanted.begin(), wanted.end()), std::set<int>{in_lens});
}

}  // namespace
}  // namespace surf::mesh
