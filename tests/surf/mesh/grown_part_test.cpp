#include "libsurf/mesh/detail/grown_part.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr double kResolution = 0.1;

CubicGrid small_grid() { return {.origin = {0, 0, 0}, .spacing = 1, .size = {12, 12, 12}}; }

/// Flags of the nodes with low <= node <= high.
std::vector<std::uint8_t> block(const CubicGrid& grid, const std::array<int, 3>& low,
                                const std::array<int, 3>& high) {
  std::vector<std::uint8_t> out(grid.n_nodes(), 0);
  for (int k = low[2]; k <= high[2]; ++k)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int i = low[0]; i <= high[0]; ++i) out[grid.node(i, j, k)] = 1;
  return out;
}

/// All cells but those next to the border.
GridCells inner_cells(const CubicGrid& grid) {
  GridCells out(grid);
  for (int k = 2; k + 3 < grid.size[2]; ++k)
    for (int j = 2; j + 3 < grid.size[1]; ++j)
      for (int i = 2; i + 3 < grid.size[0]; ++i) out.set(i, j, k);
  return out;
}

TEST(ThinParts, WallsOfOneNodeGo) {
  const CubicGrid grid = small_grid();
  std::vector<std::uint8_t> inside = block(grid, {5, 3, 3}, {5, 8, 8});
  open_thin_parts(grid, inner_cells(grid), 1, inside);
  EXPECT_EQ(inside, std::vector<std::uint8_t>(grid.n_nodes(), 0));
}

TEST(ThinParts, WallsOfTwoNodesStay) {
  const CubicGrid grid = small_grid();
  const std::vector<std::uint8_t> before = block(grid, {5, 3, 3}, {6, 8, 8});
  std::vector<std::uint8_t> inside = before;
  open_thin_parts(grid, inner_cells(grid), 1, inside);
  EXPECT_EQ(inside, before);
}

TEST(ThinParts, GapsOfOneNodeAreFilled) {
  const CubicGrid grid = small_grid();
  const std::vector<std::uint8_t> full(grid.n_nodes(), 1);
  std::vector<std::uint8_t> inside = full;
  for (int k = 3; k <= 8; ++k)
    for (int j = 3; j <= 8; ++j) inside[grid.node(5, j, k)] = 0;
  const std::vector<std::uint8_t> with_gap = inside;
  open_thin_parts(grid, inner_cells(grid), 1, inside);
  EXPECT_EQ(inside, with_gap);
  open_thin_parts(grid, inner_cells(grid), 0, inside);
  EXPECT_EQ(inside, full);
}

TEST(ThinParts, StayOutsideTheZone) {
  const CubicGrid grid = small_grid();
  const std::vector<std::uint8_t> before = block(grid, {5, 3, 3}, {5, 8, 8});
  std::vector<std::uint8_t> inside = before;
  GridCells zone(grid);
  zone.set(5, 4, 4);  // nodes 4 and 5 of the wall
  open_thin_parts(grid, zone, 1, inside);
  std::vector<std::uint8_t> expected = before;
  for (const int k : {4, 5})
    for (const int j : {4, 5}) expected[grid.node(5, j, k)] = 0;
  EXPECT_EQ(inside, expected);
}

TEST(GridRound, HasNodesAtPlacesThatDoNotDependOnTheTriangles) {
  const auto grid_of = [](const Eigen::Vector3d& center) {
    const ConnectedSurface surface(to_mesh(ball(center, 1, 0.4)));
    std::vector<int> all(surface.n_triangles());
    for (int t = 0; t < surface.n_triangles(); ++t) all[t] = t;
    return grid_round(surface, all, kResolution).value();
  };
  const CubicGrid a = grid_of({0, 0, 0}), b = grid_of({0.234, -5.1, 7.77});
  const Eigen::Array3d steps = (b.origin - a.origin).array() / kResolution;
  EXPECT_LT((steps - steps.round()).abs().maxCoeff(), 1e-9);
}

TEST(GridRound, LeavesCellsBetweenTheTrianglesAndItsBorder) {
  const ConnectedSurface surface(to_mesh(ball({0.3, 0.2, 0.1}, 1, 0.4)));
  std::vector<int> all(surface.n_triangles());
  for (int t = 0; t < surface.n_triangles(); ++t) all[t] = t;
  const CubicGrid grid = grid_round(surface, all, kResolution).value();
  const Eigen::Vector3d low = surface.triangles.points.colwise().minCoeff(),
                        high = surface.triangles.points.colwise().maxCoeff(),
                        last = grid.position(grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1);
  constexpr double kGap = 4 * kResolution;  // cells are set up to 3 cells from the triangles
  EXPECT_GT((low - grid.origin).minCoeff(), kGap);
  EXPECT_GT((last - high).minCoeff(), kGap);
}

TEST(GridRound, IsNoneOfTooManyNodes) {
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, 0.4)));
  EXPECT_FALSE(grid_round(surface, {0, surface.n_triangles() - 1}, 1e-3));
}

/// A ball on its grid; the part grows in the cells of a box of space.
struct BallOnGrid {
  static constexpr double kRadius = 1;
  const ConnectedSurface surface{to_mesh(ball({0, 0, 0}, kRadius, 0.1))};
  const CubicGrid grid = [this] {
    std::vector<int> all(surface.n_triangles());
    for (int t = 0; t < surface.n_triangles(); ++t) all[t] = t;
    return grid_round(surface, all, kResolution).value();
  }();
  const WindingGrid winding{surface.triangles.points, surface.triangles.elements, grid};
  GridCells cells{grid};

  void set_cells_above(double z) {
    for (int k = 1; k + 2 < grid.size[2]; ++k)
      for (int j = 1; j + 2 < grid.size[1]; ++j)
        for (int i = 1; i + 2 < grid.size[0]; ++i)
          if (grid.position(i, j, k)[2] > z) cells.set(i, j, k);
  }
};

TEST(GrownPart, IsAClosedBallInAllCells) {
  BallOnGrid b;
  b.set_cells_above(-10);
  const auto part = grow(b.winding.inside(), b.winding, 0, b.cells);
  ASSERT_TRUE(part);
  EXPECT_TRUE(part->rims.empty());
  EXPECT_FALSE(part->has_more_cells);
  Triangles out{Points<3>(part->points.size(), 3), Elements<3>(part->triangles.size(), 3)};
  for (std::size_t i = 0; i < part->points.size(); ++i) out.points.row(i) = part->points[i];
  for (std::size_t t = 0; t < part->triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) out.elements(t, i) = part->triangles[t][i];
  EXPECT_NO_THROW(check_mesh(to_mesh(out)));
  // Chords of 0.1 lie 0.1^2 / 8 below the arc at most in each direction; vertices that keep from
  // the ends of their edges are off by a share of 0.05 of the spacing.
  constexpr double kTolerance = 0.05 * kResolution + 0.1 * 0.1 / 3;
  for (const Vector<3>& x : part->points) EXPECT_NEAR(x.norm(), BallOnGrid::kRadius, kTolerance);
}

TEST(GrownPart, IsACapWithOneRimInTheCellsAboveAPlane) {
  BallOnGrid b;
  b.set_cells_above(0.5);
  constexpr int kFirst = 1000;
  const auto part = grow(b.winding.inside(), b.winding, kFirst, b.cells);
  ASSERT_TRUE(part);
  ASSERT_EQ(part->rims.size(), 1u);
  double lowest = 10;
  for (const Vector<3>& x : part->points) lowest = std::min(lowest, x[2]);
  for (const int v : part->rims[0]) {
    ASSERT_GE(v, kFirst);
    EXPECT_NEAR(part->points[v - kFirst][2], lowest, 1e-12);  // on the face of the cells
  }
  EXPECT_EQ(part->is_loose, std::vector<char>(part->points.size(), 0));
}

/// Two cells of the surface that share one of its vertices only, across the corner of the cells.
TEST(GrownPart, GetsCellsWhereItWouldTouchItselfInAVertex) {
  BallOnGrid b;
  int i = b.grid.size[0] / 2, j = b.grid.size[1] / 2, k = 0;
  for (int n = 0; n + 1 < b.grid.size[2]; ++n)  // the highest edge that the ball passes
    if (b.winding.inside()[b.grid.node(i, j, n)]) k = n;
  b.cells.set(i, j, k);
  b.cells.set(i - 1, j - 1, k);
  const auto part = grow(b.winding.inside(), b.winding, 0, b.cells);
  ASSERT_TRUE(part);
  EXPECT_TRUE(part->has_more_cells);
  EXPECT_TRUE(b.cells(i - 1, j, k));
  EXPECT_TRUE(b.cells(i, j - 1, k));
  EXPECT_EQ(part->rims.size(), 1u);
}

TEST(GrownPart, HasLooseVerticesWhereTheNodesDifferFromTheSurface) {
  BallOnGrid b;
  b.set_cells_above(-10);
  std::vector<std::uint8_t> inside = b.winding.inside();
  // A block of the inside taken out: its sides are no crossings.
  const int m = b.grid.size[0] / 2;
  for (int c = 0; c < 8; ++c) inside[b.grid.node(m + (c & 1), m + (c >> 1 & 1), m + (c >> 2))] = 0;
  const auto part = grow(inside, b.winding, 0, b.cells);
  ASSERT_TRUE(part);
  constexpr int kEdgesOutOfABlock = 24;  // 8 nodes with 3 edges each
  EXPECT_EQ(std::count(part->is_loose.begin(), part->is_loose.end(), 1), kEdgesOutOfABlock);
}

}  // namespace
}  // namespace surf::mesh
