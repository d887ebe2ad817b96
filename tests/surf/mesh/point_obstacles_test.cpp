#include "libsurf/mesh/point_obstacles.h"

#include <gtest/gtest.h>

#include <random>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

Points<3> random_points(int n, unsigned seed, double half_width) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(-half_width, half_width);
  Points<3> out(n, 3);
  for (double& x : out.reshaped()) x = coordinate(random);
  return out;
}

TEST(PointObstacles, TellsWhichPointsLieInAShell) {
  const Triangles shell = joined({ball({0, 0, 0}, 2, 0.2), flipped(ball({0, 0, 0}, 1, 0.2))});
  const Points<3> points = random_points(500, 3, 2.5);
  const std::vector<char> inside = are_inside<3>(shell, points);
  int n = 0;
  for (int k = 0; k < points.rows(); ++k) {
    const double radius = points.row(k).norm();
    if (std::abs(radius - 2) < 0.02 || std::abs(radius - 1) < 0.02) continue;  // between the facets
    EXPECT_EQ(bool(inside[k]), radius > 1 && radius < 2) << radius;
    ++n;
  }
  EXPECT_GT(n, 450);
}

TEST(PointObstacles, LeavesStepsThatComeNearNothingAsTheyAre) {
  const Triangles surface = ball({0, 0, 0}, 2, 0.2);
  const PointObstacles<3> obstacles({{2.6, 0, 0}, {0, 0, 1.4}}, 0.2, {});
  const Points<3> wanted = 1.1 * surface.points;  // radius 2.2
  Points<3> to = wanted;
  obstacles.limit(surface.points, surface.elements, to);
  EXPECT_EQ(to, wanted);
}

/// Of all points to the surface.
void expect_clear(const Triangles& surface, const PointObstacles<3>& obstacles, double radius) {
  const DistanceToSurface distance(surface);
  for (const Vector3d& point : obstacles.points()) EXPECT_GE(distance(point), (1 - 1e-6) * radius);
}

// Steps of 0.5 past balls of radius 0.1: further than these are wide.
TEST(PointObstacles, LimitsStepsThatWouldPassOverPoints) {
  constexpr double kRadius = 0.1;
  const Triangles surface = ball({0, 0, 0}, 2, 0.2);
  std::vector<Vector3d> points;
  const Points<3> places = random_points(20, 5, 1);
  for (const auto row : places.rowwise())
    points.push_back((2.15 + 0.1 * row[0]) * Vector3d(row.transpose()).normalized());
  const PointObstacles<3> obstacles(points, kRadius, {});
  const Points<3> wanted = 1.25 * surface.points;
  Points<3> to = wanted;
  obstacles.limit(surface.points, surface.elements, to);
  const Triangles moved{to, surface.elements};
  expect_clear(moved, obstacles, kRadius);
  Points<3> rows(20, 3);
  for (int k = 0; k < 20; ++k) rows.row(k) = points[k];
  for (const char flag : are_inside<3>(moved, rows)) EXPECT_FALSE(flag);
  // Most of the surface goes all the way.
  int n_free = 0;
  for (int i = 0; i < to.rows(); ++i) n_free += to.row(i) == wanted.row(i);
  EXPECT_GT(n_free, 0.7 * double(to.rows()));
}

TEST(PointObstacles, TakeBackWhatLeavesAnElementInABall) {
  const Triangles surface = ball({0, 0, 0}, 2, 0.2);
  const PointObstacles<3> obstacles({{2.2, 0, 0}}, 0.1, {});
  Points<3> limited = 1.2 * surface.points;
  obstacles.limit(surface.points, surface.elements, limited);
  Points<3> to = 1.2 * surface.points;  // as if it had not been limited
  EXPECT_GT(obstacles.hold(surface.points, limited, surface.elements, to), 0);
  expect_clear({to, surface.elements}, obstacles, 0.1);
  EXPECT_TRUE(obstacles.violated(surface.elements, to).empty());
}

/// Points on both sides of a surface in a random flow stay on their side, with mending, surgery and
/// adaptivity.
TEST(MovingSurface, StaysAwayFromHeldPointsInRandomFlows) {
  constexpr double kRadius = 0.05, kEdge = 0.15;
  int n_near = 0;
  for (const Topology topology : {Topology::kFree, Topology::kFixed}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      MovingSurfaceOptions options{.edge_length_mm = kEdge, .topology = topology, .box = {}};
      options.coarseness = 4;
      options.adaptivity.geometry_tolerance_mm = 0.1;
      options.held_distance_mm = kRadius;
      const Points<3> places = random_points(120, seed, 1.3);
      for (const auto row : places.rowwise())
        if (std::abs(row.norm() - 1) > 0.1)
          options.held_points.push_back({row.transpose(), row.norm() < 1});
      MovingSurface surface(ball({0, 0, 0}, 1, kEdge), options);
      std::mt19937 random(seed);
      const WavyField field(random, 0.1);
      for (int k = 0; k < 12; ++k) {
        Points<3> to = surface.geometry().points();
        for (auto row : to.rowwise()) row += field(row.transpose());
        to +=
            0.03 * (seed % 2 ? 1 : -1) * surface.geometry().nodal_normals().rowwise().normalized();
        surface.restrict_move(to);
        surface.move_to(to);
        surface.mend();
        const Triangles now = surface.simplices();
        const Verification check = verify(now);
        ASSERT_TRUE(check.passed()) << check.message();
        const std::vector<char> held =
            are_held<3>(now, options.held_points, (1 - 1e-6) * kRadius, {});
        for (std::size_t n = 0; n < held.size(); ++n)
          ASSERT_TRUE(held[n]) << int(topology) << ", seed " << seed << ", step " << k << ", point "
                               << options.held_points[n].point.transpose();
        const DistanceToSurface distance(now);
        for (const auto& one : options.held_points) n_near += distance(one.point) < 1.5 * kRadius;
      }
    }
  }
  EXPECT_GT(n_near, 100);  // else nothing was tried
}

TEST(MovingSurface, BringsItsStartToWhereItHasPointsNearItsEdge) {
  MovingSurfaceOptions options{.edge_length_mm = 0.2, .box = {}};
  options.coarseness = 4;
  options.adaptivity.geometry_tolerance_mm = 0.1;
  options.held_distance_mm = 0.07;
  options.held_points = {{{0.8, 0, 0}, false},  // 0.2 deep
                         {{0, 1.2, 0}, true},
                         {{0, 0, 1.03}, false},   // outside, but too near
                         {{0, 0, -0.2}, false}};  // too deep
  const MovingSurface surface(ball({0, 0, 0}, 1, 0.2), options);
  const Triangles now = surface.simplices();
  EXPECT_TRUE(verify(now).passed());
  EXPECT_EQ(are_held<3>(now, options.held_points, 0.07, {}), (std::vector<char>{1, 1, 1, 0}));
  EXPECT_NEAR(surface.geometry().enclosed(), 4.0 / 3 * M_PI, 0.15);
}

// What is too deep in the start is no obstacle until the surface has passed it.
TEST(MovingSurface, HoldsAPointFromWhenItHasPassedIt) {
  MovingSurfaceOptions options{.edge_length_mm = 0.2, .topology = Topology::kFree, .box = {}};
  options.held_distance_mm = 0.07;
  options.held_points = {{{1, 0, 0}, false}};
  MovingSurface surface(ball({0, 0, 0}, 2, 0.2), options);
  const auto move = [&](double step) {
    Points<3> to = surface.geometry().points();
    to += step * surface.geometry().nodal_normals().rowwise().normalized();
    surface.restrict_move(to);
    surface.move_to(to);
    surface.mend();
  };
  const auto is_held = [&] {
    return are_held<3>(surface.simplices(), options.held_points, 0.07, {}).front() != 0;
  };
  while (surface.geometry().radius() > 0.75) move(-0.1);
  EXPECT_TRUE(is_held());
  for (int k = 0; k < 4; ++k) {
    move(0.1);
    EXPECT_TRUE(is_held()) << k;
  }
  EXPECT_TRUE(verify(surface.simplices()).passed());
  EXPECT_GT(surface.geometry().radius(), 1.05);  // beyond the point
}

}  // namespace
}  // namespace surf::mesh
