#include "libsurf/mesh/detail/winding_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/mesh/primitives.h"

namespace surf::mesh {
namespace {

CubicGrid some_grid() {
  return {.origin = {-1.47, -1.52, -1.49}, .spacing = 0.1, .size = {31, 30, 32}};
}

/// Compares the flags with a rule for all nodes further than the mesh's error from its surfaces.
template <class Rule>
void expect_inside(const Triangles& surface, const Rule& rule) {
  const CubicGrid grid = some_grid();
  const WindingGrid winding(surface.points, surface.elements, grid);
  int n_compared = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const int expected = rule(grid.position(i, j, k));  // -1: too close to say
        if (expected < 0) continue;
        ++n_compared;
        ASSERT_EQ(int(winding.inside()[grid.node(i, j, k)]), expected)
            << grid.position(i, j, k).transpose();
      }
  EXPECT_GT(n_compared, 20000);
}

/// 1 inside the sphere, 0 outside, -1 within 0.02 of it: chords of 0.1 lie 0.0013 below the arc.
int in_ball(const Eigen::Vector3d& x, const Eigen::Vector3d& center, double radius) {
  const double d = (x - center).norm() - radius;
  return std::abs(d) < 0.02 ? -1 : d < 0;
}

TEST(WindingGrid, IsOneInABall) {
  expect_inside(ball({0, 0, 0}, 1, 0.1), [](const auto& x) { return in_ball(x, {0, 0, 0}, 1); });
}

TEST(WindingGrid, CountsWhatIsCoveredTwiceOnce) {
  expect_inside(joined({ball({-0.4, 0, 0}, 0.8, 0.1), ball({0.4, 0, 0}, 0.8, 0.1)}),
                [](const auto& x) {
                  const int a = in_ball(x, {-0.4, 0, 0}, 0.8), b = in_ball(x, {0.4, 0, 0}, 0.8);
                  return a == 1 || b == 1 ? 1 : std::min(a, b);
                });
}

TEST(WindingGrid, LeavesOutCavitiesAndWhatIsInverted) {
  expect_inside(joined({ball({0, 0, 0}, 1.2, 0.1), flipped(ball({0, 0, 0}, 0.6, 0.1))}),
                [](const auto& x) {
                  const int outer = in_ball(x, {0, 0, 0}, 1.2), inner = in_ball(x, {0, 0, 0}, 0.6);
                  return outer < 0 || inner < 0 ? -1 : int(outer && !inner);
                });
  expect_inside(flipped(ball({0, 0, 0}, 1, 0.1)), [](const auto& x) {
    return in_ball(x, {0, 0, 0}, 1) < 0 ? -1 : 0;
  });
}

TEST(WindingGrid, FindsCrossingsOnTheSphere) {
  const CubicGrid grid = some_grid();
  const Triangles sphere = ball({0, 0, 0}, 1, 0.05);
  const WindingGrid winding(sphere.points, sphere.elements, grid);
  int n_crossings = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k + 1 < grid.size[2]; ++k)
      for (int j = 0; j + 1 < grid.size[1]; ++j)
        for (int i = 0; i + 1 < grid.size[0]; ++i) {
          std::array<int, 3> next = {i, j, k};
          ++next[axis];
          const bool changes = winding.inside()[grid.node(i, j, k)] !=
                               winding.inside()[grid.node(next[0], next[1], next[2])];
          const double share = winding.crossing(axis, {i, j, k});
          ASSERT_EQ(changes, share > 0);
          if (!changes) continue;
          ++n_crossings;
          Eigen::Vector3d at = grid.position(i, j, k);
          at[axis] += share * grid.spacing;
          EXPECT_NEAR(at.norm(), 1, 0.002);  // the chord's height, and 1e-3 of the spacing
        }
  EXPECT_GT(n_crossings, 1000);
}

TEST(WindingGrid, TellsTheSidesOfATriangle) {
  const Triangles outer = ball({0, 0, 0}, 1, 0.3), inner = ball({0.1, 0, 0}, 0.5, 0.3);
  const auto sides_of_second = [](const Triangles& first, const Triangles& second) {
    const Triangles both = joined({first, second});
    return winding_beside(both.points, both.elements, int(first.elements.rows()) + 3);
  };
  const auto is = [](const SidesOfTriangle& sides, int inner_side, int outer_side) {
    return sides.inner == inner_side && sides.outer == outer_side;
  };
  EXPECT_TRUE(is(sides_of_second(inner, outer), 1, 0));           // real
  EXPECT_TRUE(is(sides_of_second(outer, inner), 2, 1));           // covered twice
  EXPECT_TRUE(is(sides_of_second(outer, flipped(inner)), 1, 0));  // a cavity
  EXPECT_TRUE(is(sides_of_second(inner, flipped(outer)), 0, -1));
}

}  // namespace
}  // namespace surf::mesh
