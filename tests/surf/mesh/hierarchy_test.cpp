#include "libsurf/mesh/hierarchy.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;
using Reason = Removal::Reason;

const Vector<3> kOrigin = Vector<3>::Zero();

Triangles all_of(const std::vector<Triangles>& parts) {
  Triangles result{Points<3>(0, 3), Elements<3>(0, 3)};
  for (const Triangles& part : parts) result = joined(result, part);
  return result;
}

Points<3> points_of(const std::vector<Vector<3>>& points) {
  return to_triangles(points, {}).points;
}

SolidFilter keeping(Keep keep, const std::vector<Vector<3>>& seeds = {}) {
  SolidFilter filter;
  filter.keep = keep;
  filter.seeds_ras_mm = points_of(seeds);
  return filter;
}

void expect_equal(const Triangles& a, const Triangles& b) {
  ASSERT_EQ(a.points.rows(), b.points.rows());
  ASSERT_EQ(a.elements.rows(), b.elements.rows());
  EXPECT_TRUE(a.points == b.points && a.elements == b.elements);
}

std::vector<Reason> reasons(const FilteredSurface& filtered) {
  std::vector<Reason> result;
  for (const Removal& removal : filtered.removed) result.push_back(removal.reason);
  return result;
}

/// A ball in a cavity of a ball, and one beside them.
struct Nest {
  Triangles outer = sphere(kOrigin, 3, 3), cavity = flipped(sphere(kOrigin, 2, 3)),
            core = sphere({0.5, 0, 0}, 1, 3), other = sphere({10, 0, 0}, 2, 3);
  Triangles surface = all_of({core, outer, cavity, other});
};

TEST(ShellHierarchy, NestsABallInAShellInTheOpen) {
  const Nest nest;
  const ShellHierarchy found = shell_hierarchy(nest.surface);
  ASSERT_EQ(found.shells.size(), 4u);
  const Shell &core = found.shells[0], &outer = found.shells[1], &cavity = found.shells[2],
              &other = found.shells[3];
  EXPECT_EQ(core.parent, 2);
  EXPECT_EQ(cavity.parent, 1);
  EXPECT_FALSE(outer.parent);
  EXPECT_FALSE(other.parent);
  EXPECT_EQ(core.depth, 2);
  EXPECT_EQ(cavity.depth, 1);
  EXPECT_EQ(outer.depth, 0);
  EXPECT_EQ(other.depth, 0);
  for (const Shell& shell : found.shells) {
    EXPECT_TRUE(shell.is_real());
    EXPECT_EQ(shell.genus, 0);
    EXPECT_EQ(shell.n_triangles, 512);
  }
  EXPECT_FALSE(cavity.is_outward);
  constexpr double kRounding = 1e-13;
  EXPECT_NEAR(cavity.volume_mm3, volume_mm3(nest.cavity), kRounding * outer.volume_mm3);
  EXPECT_NEAR(outer.volume_mm3, volume_mm3(nest.outer), kRounding * outer.volume_mm3);
  EXPECT_NEAR(other.area_mm2, area_mm2(nest.other), kRounding * other.area_mm2);
  EXPECT_LT((other.center_ras_mm - Vector<3>(10, 0, 0)).norm(), 10 * kRounding);
  ASSERT_EQ(found.of_triangle.size(), 2048u);
  for (int row = 0; row < 2048; ++row) EXPECT_EQ(found.of_triangle[row], row / 512);
}

TEST(ShellHierarchy, ATorusEnclosesItsTubeButNotItsHole) {
  const Triangles ring = torus(3, 1, 40, 20);
  const auto found =
      shell_hierarchy(all_of({ring, sphere(kOrigin, 1, 2), flipped(sphere({-3, 0, 0}, 0.5, 2))}));
  EXPECT_EQ(found.shells[0].genus, 1);
  EXPECT_EQ(found.shells[1].depth, 0);
  EXPECT_EQ(found.shells[2].parent, 0);
  EXPECT_TRUE(found.shells[0].is_real() && found.shells[1].is_real() && found.shells[2].is_real());
}

TEST(ShellHierarchy, NumbersTheSidesOfPhantoms) {
  const auto shells = shell_hierarchy(all_of({flipped(sphere({9, 0, 0}, 1, 2)),  // -1 | 0
                                              sphere({9, 0, 0}, 0.5, 2),         // -1 | 0 inside it
                                              sphere(kOrigin, 3, 3),             // 0 | 1
                                              sphere(kOrigin, 2, 3),             // 1 | 2
                                              flipped(sphere(kOrigin, 1, 3))}))  // back to 1
                          .shells;
  const int before[5] = {-1, -1, 0, 1, 1};
  for (int n = 0; n < 5; ++n) {
    EXPECT_EQ(shells[n].winding_before, before[n]) << n;
    EXPECT_EQ(shells[n].is_real(), n == 2) << n;
  }
}

TEST(ShellHierarchy, NothingHasNoShells) {
  EXPECT_TRUE(shell_hierarchy({Points<3>(0, 3), Elements<3>(0, 3)}).shells.empty());
}

// Tetrahedra whose fourth corner is the double nearest to the plane of the others.
TEST(ShellHierarchy, OrientsShellsWhoseVolumesRoundingHides) {
  using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(10, 11);
  int n_hidden = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    Triangles flat = tetrahedron();
    for (double& x : flat.points.reshaped()) x = uniform(random);
    flat.points.row(3) = flat.points.topRows(3).colwise().mean();
    std::vector<Point> p;
    for (const auto row : flat.points.rowwise()) p.emplace_back(row[0], row[1], row[2]);
    const auto side = CGAL::orientation(p[0], p[1], p[2], p[3]);
    if (side == CGAL::COPLANAR) continue;
    const Shell found = shell_hierarchy(flat).shells[0];
    EXPECT_EQ(found.is_outward, side == CGAL::POSITIVE);
    n_hidden += (found.volume_mm3 > 0) != found.is_outward;
  }
  EXPECT_GT(n_hidden, 5);
}

struct Ball {
  Vector<3> center;
  double radius;
  bool is_outward;
  bool encloses(const Ball& b) const { return (center - b.center).norm() + b.radius < radius; }
};

constexpr double kInscribed = 0.9;  // the polyhedra of level 2 contain this part of their balls

/// Balls whose shells do not meet, in random order; most are put into an earlier one.
std::vector<Ball> random_balls(std::mt19937& random, int n) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Ball> result;
  while (int(result.size()) < n) {
    const Ball world{{0, 0, 0}, 20, true};
    const bool is_inside = uniform(random) < 0.7 && !result.empty();
    const Ball& in = is_inside ? result[random() % result.size()] : world;
    const Vector<3> to(2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1);
    const Ball ball{in.center + 0.6 * in.radius * to, in.radius * (0.9 * uniform(random) + 0.01),
                    uniform(random) < 0.5};
    const bool is_clear = std::all_of(result.begin(), result.end(), [&](const Ball& other) {
      const double distance = (ball.center - other.center).norm();
      return distance > ball.radius + other.radius ||
             distance + ball.radius < kInscribed * other.radius ||
             distance + other.radius < kInscribed * ball.radius;
    });
    if (is_clear) result.push_back(ball);
  }
  std::shuffle(result.begin(), result.end(), random);
  return result;
}

Triangles shells_of(const std::vector<Ball>& balls) {
  std::vector<Triangles> parts;
  for (const Ball& ball : balls) {
    const Triangles part = sphere(ball.center, ball.radius, 2);
    parts.push_back(ball.is_outward ? part : flipped(part));
  }
  return all_of(parts);
}

TEST(ShellHierarchy, AgreesWithTheBallsOfRandomSoups) {
  std::mt19937 random(11);
  int n_nested = 0, n_real = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<Ball> balls = random_balls(random, 1 + trial % 30);
    const auto shells = shell_hierarchy(shells_of(balls)).shells;
    ASSERT_EQ(shells.size(), balls.size());
    for (std::size_t n = 0; n < balls.size(); ++n) {
      int depth = 0, winding = balls[n].is_outward ? 0 : -1;
      std::optional<int> parent;
      for (std::size_t m = 0; m < balls.size(); ++m) {
        if (m == n || !balls[m].encloses(balls[n])) continue;
        ++depth;
        winding += balls[m].is_outward ? 1 : -1;
        if (!parent || balls[m].radius < balls[*parent].radius) parent = int(m);
      }
      ASSERT_EQ(shells[n].depth, depth);
      ASSERT_EQ(shells[n].parent, parent);
      ASSERT_EQ(shells[n].winding_before, winding);
      ASSERT_EQ(shells[n].is_outward, balls[n].is_outward);
      n_nested += depth > 1;
      n_real += shells[n].is_real();
    }
  }
  EXPECT_GT(n_nested, 100);  // the soups are worth it
  EXPECT_GT(n_real, 100);
}

TEST(WithoutPhantoms, LeavesTheBoundaryOfTheDomainInRandomSoups) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<Ball> balls = random_balls(random, 1 + trial % 30);
    const FilteredSurface found = filtered(shells_of(balls));
    const auto shells = shell_hierarchy(found.surface).shells;
    EXPECT_EQ(shells.size() + found.removed.size(), balls.size());
    for (const Shell& shell : shells) {
      EXPECT_TRUE(shell.is_real());
      EXPECT_EQ(shell.is_outward, shell.depth % 2 == 0);
    }
    EXPECT_TRUE(shells.empty() || verify(found.surface).passed());
  }
}

TEST(WithoutPhantoms, LeavesAGoodSurfaceBitForBit) {
  const Nest nest;
  const FilteredSurface found = filtered(nest.surface);
  expect_equal(found.surface, nest.surface);
  EXPECT_TRUE(found.removed.empty());
}

TEST(WithoutPhantoms, RemovesInvertedShellsInTheOpen) {
  const Nest nest;
  const FilteredSurface found = filtered(all_of({flipped(nest.other), nest.outer, nest.cavity}));
  expect_equal(found.surface, joined(nest.outer, nest.cavity));
  ASSERT_EQ(reasons(found), std::vector{Reason::kPhantom});
  EXPECT_EQ(found.removed[0].n_shells, 1);
  EXPECT_LT(found.removed[0].volume_mm3, 0);
  constexpr double kRounding = 1e-12;
  EXPECT_LT((found.removed[0].center_ras_mm - Vector<3>(10, 0, 0)).norm(), kRounding);
}

TEST(WithoutPhantoms, RemovesOutwardShellsInOutwardOnes) {
  const FilteredSurface found =
      filtered(all_of({sphere(kOrigin, 1, 2), sphere(kOrigin, 3, 2), sphere(kOrigin, 2, 2)}));
  expect_equal(found.surface, sphere(kOrigin, 3, 2));
  EXPECT_EQ(reasons(found), (std::vector{Reason::kPhantom, Reason::kPhantom}));
}

// Two outward shells make a winding number of 2: an inverted one there ends no domain, two do.
TEST(WithoutPhantoms, KeepsTheCavityWhereTheWindingNumberFallsToZero) {
  const Triangles twice = joined(sphere(kOrigin, 5, 2), sphere(kOrigin, 4, 2)),
                  inner = flipped(sphere(kOrigin, 2, 2));
  const Triangles cavities = joined(flipped(sphere(kOrigin, 3, 2)), inner);
  expect_equal(filtered(joined(twice, cavities)).surface, joined(sphere(kOrigin, 5, 2), inner));
  expect_equal(filtered(joined(twice, inner)).surface, sphere(kOrigin, 5, 2));
}

// Algorithm 16 would remove the ball with the phantom round it.
TEST(WithoutPhantoms, KeepsADomainInsideAPhantom) {
  const Triangles ball = sphere(kOrigin, 1, 2);
  const Triangles inverted = flipped(sphere(kOrigin, 3, 2)), outward = sphere(kOrigin, 2, 2);
  expect_equal(filtered(all_of({inverted, outward, ball})).surface, ball);
  const FilteredSurface none = filtered(joined(inverted, outward));
  EXPECT_EQ(none.surface.elements.rows(), 0);
  EXPECT_EQ(none.surface.points.rows(), 0);
  EXPECT_EQ(none.removed.size(), 2u);
}

TEST(Solids, HaveTheirCavities) {
  const Nest nest;
  const std::vector<Solid> found = solids(shell_hierarchy(nest.surface));
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].outer, 0);
  EXPECT_EQ(found[1].outer, 1);
  EXPECT_EQ(found[2].outer, 3);
  EXPECT_TRUE(found[0].cavities.empty());
  EXPECT_EQ(found[1].cavities, std::vector<int>{2});
  const Triangles hollow = joined(nest.outer, nest.cavity);
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(found[1].volume_mm3, volume_mm3(hollow), kRounding);
  EXPECT_NEAR(found[1].area_mm2, area_mm2(hollow), kRounding);
}

TEST(Filtered, FillsCavitiesWithAllThatLiesInThem) {
  const Nest nest;
  SolidFilter filter;
  filter.fill_cavities = true;
  const FilteredSurface found = filtered(nest.surface, filter);
  expect_equal(found.surface, joined(nest.outer, nest.other));
  EXPECT_EQ(reasons(found), (std::vector{Reason::kFilled, Reason::kSwallowed}));
  EXPECT_LT(found.removed[0].volume_mm3, 0);
  EXPECT_GT(found.removed[1].volume_mm3, 0);
}

TEST(Filtered, CavitiesOfASmallComponentGoWithIt) {
  const Nest nest;  // volumes: core 4, hollow 79, other 32
  SolidFilter filter;
  filter.min_volume_mm3 = 20;
  expect_equal(filtered(nest.surface, filter).surface,
               all_of({nest.outer, nest.cavity, nest.other}));
  filter.min_volume_mm3 = 85;  // the outer shell alone has 110
  const FilteredSurface none = filtered(nest.surface, filter);
  EXPECT_EQ(none.surface.elements.rows(), 0);
  EXPECT_EQ(reasons(none), std::vector(3, Reason::kSmall));
  EXPECT_EQ(none.removed[1].n_shells, 2);
  filter.fill_cavities = true;
  expect_equal(filtered(nest.surface, filter).surface, nest.outer);
}

TEST(Filtered, KeepsTheLargestBySolidVolume) {
  const Nest nest;
  expect_equal(filtered(nest.surface, keeping(Keep::kLargest)).surface,
               joined(nest.outer, nest.cavity));
  // A thin shell round much air has less volume than the ball beside it.
  const Triangles thin = joined(nest.outer, flipped(sphere(kOrigin, 2.95, 3)));
  expect_equal(filtered(joined(thin, nest.other), keeping(Keep::kLargest)).surface, nest.other);
  const Triangles twin = moved(cube(), {-8, 0, 0});  // of equal ones the first
  expect_equal(filtered(joined(twin, cube()), keeping(Keep::kLargest)).surface, twin);
}

TEST(Filtered, KeepsWhatContainsASeed) {
  const Nest nest;
  const auto kept = [&](const std::vector<Vector<3>>& seeds) {
    return filtered(nest.surface, keeping(Keep::kSeeded, seeds)).surface;
  };
  const Vector<3> in_core(0.5, 0.1, 0), in_wall(0, 2.5, 0), in_cavity(-1, 0, 0), beside(5, 0, 0),
      in_other(10, 0, 0);
  expect_equal(kept({in_core}), nest.core);
  expect_equal(kept({in_wall}), joined(nest.outer, nest.cavity));
  expect_equal(kept({beside, in_other, in_other}), nest.other);
  expect_equal(kept({in_wall, in_other}), all_of({nest.outer, nest.cavity, nest.other}));
  EXPECT_EQ(kept({in_cavity, beside}).elements.rows(), 0);
  SolidFilter filter = keeping(Keep::kSeeded, {in_cavity});
  filter.fill_cavities = true;
  const FilteredSurface filled = filtered(nest.surface, filter);
  expect_equal(filled.surface, nest.outer);
  EXPECT_EQ(filled.removed.back().reason, Reason::kNotSeeded);
}

TEST(Filtered, RemovesPhantomsToo) {
  const Nest nest;
  const Triangles surface = all_of({nest.other, flipped(moved(nest.outer, {0, 20, 0})), nest.core});
  const FilteredSurface found = filtered(surface, keeping(Keep::kLargest));
  expect_equal(found.surface, nest.other);
  EXPECT_EQ(reasons(found), (std::vector{Reason::kPhantom, Reason::kNotLargest}));
}

TEST(Filtered, DropsPointsThatNoTriangleUses) {
  Triangles surface = cube();
  surface.points.conservativeResize(9, 3);
  surface.points.row(8).setConstant(7);
  expect_equal(filtered(surface, {}).surface, cube());
}

TEST(Filtered, RefusesInvalidFiltersByName) {
  SolidFilter filter;
  filter.min_volume_mm3 = -1;
  EXPECT_NE(filter.error().find("SolidFilter::min_volume_mm3 = -1"), std::string::npos);
  EXPECT_THROW(filtered(cube(), filter), UsageError);
  EXPECT_THROW(filtered(cube(), keeping(Keep::kSeeded)), UsageError);
  filter = keeping(Keep::kSeeded, {kOrigin});
  filter.seeds_ras_mm(0, 1) = std::nan("");
  EXPECT_THROW(filtered(cube(), filter), UsageError);
}

}  // namespace
}  // namespace surf::mesh
