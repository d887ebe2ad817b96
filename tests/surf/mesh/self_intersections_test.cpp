#include "libsurf/mesh/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;
using Pairs = std::vector<std::pair<int, int>>;

Pairs pairs_of_cgal(const Triangles& surface) {
  CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3> mesh;
  using Vertex = decltype(mesh)::Vertex_index;
  for (const auto p : surface.points.rowwise()) mesh.add_vertex({p[0], p[1], p[2]});
  for (const auto e : surface.elements.rowwise())
    mesh.add_face(Vertex(e[0]), Vertex(e[1]), Vertex(e[2]));
  std::vector<std::pair<decltype(mesh)::Face_index, decltype(mesh)::Face_index>> found;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(found));
  Pairs result;
  for (const auto& [a, b] : found)
    if (a != b) result.push_back(std::minmax<int>(int(a), int(b)));  // (a, a): a is degenerate
  std::sort(result.begin(), result.end());
  return result;
}

/// A sphere whose vertices moved at random: the more, the more it intersects itself.
Triangles crumpled(double amplitude, unsigned seed) {
  Triangles surface = sphere({1, 2, 3}, 10, 4);
  std::srand(seed);
  surface.points += amplitude * Points<3>::Random(surface.points.rows(), 3);
  return surface;
}

TEST(SelfIntersections, AreThoseOfCgal) {
  std::size_t n = 0;
  for (const double amplitude : {0.0, 0.3, 0.6, 1.0, 3.0}) {
    const Triangles surface = crumpled(amplitude, 5);
    const Pairs found = self_intersections(surface);
    EXPECT_EQ(found, pairs_of_cgal(surface)) << amplitude;
    n = std::max(n, found.size());
  }
  EXPECT_GT(n, 1000u);
}

/// Pairs with a flagged triangle.
Pairs with_active(Pairs pairs, const std::vector<char>& active) {
  std::erase_if(pairs, [&](const auto& p) { return !active[p.first] && !active[p.second]; });
  return pairs;
}

TEST(SelfIntersections, OfActiveTrianglesAreThoseOfCgalWithOne) {
  for (const double amplitude : {0.1, 0.3, 0.6, 1.0, 3.0}) {
    const Triangles surface = crumpled(amplitude, 6);
    const Pairs all = pairs_of_cgal(surface);
    for (const int every : {1, 2, 7, 50}) {
      std::vector<char> active(surface.elements.rows());
      for (std::size_t i = 0; i < active.size(); i += every) active[i] = 1;
      EXPECT_EQ(self_intersections(surface.points, surface.elements, active),
                with_active(all, active))
          << amplitude << ", every " << every;
    }
  }
  const Triangles surface = crumpled(1, 6);
  EXPECT_TRUE(self_intersections(surface.points, surface.elements,
                                 std::vector<char>(surface.elements.rows(), 0))
                  .empty());
}

// Flat, folded and touching triangles in all positions: what tests with rounding get wrong.
TEST(SelfIntersections, AreThoseOfCgalWhereTrianglesTouchOrLieInOnePlane) {
  std::size_t n = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    Triangles surface = sphere({0, 0, 0}, 4, 3);
    std::srand(seed);
    surface.points += Points<3>::Random(surface.points.rows(), 3);
    surface.points = surface.points.array().round();  // on a grid of 9^3 points
    const Pairs found = self_intersections(surface);
    EXPECT_EQ(found, pairs_of_cgal(surface)) << seed;
    n += found.size();
  }
  EXPECT_GT(n, 1000u);
}

TEST(SelfIntersections, AreThoseOfCgalWithTrianglesOfVeryDifferentSize) {
  const Triangles large = sphere({0, 0, 0}, 10, 1);
  const Vector<3> corner = large.points.row(0);
  const Triangles surface = joined(large, sphere(corner, 0.3, 4));
  const Pairs found = self_intersections(surface);
  EXPECT_EQ(found, pairs_of_cgal(surface));
  EXPECT_FALSE(found.empty());
}

// Twice round the vertex: every triangle of the star faces the eye, and they intersect.
TEST(SelfIntersections, SeeAStarThatLiesTwiceRoundItsVertex) {
  std::vector<Vector<3>> points = {{0, 0, 0}};
  std::vector<std::array<int, 3>> elements;
  constexpr int kSpokes = 10;
  for (int k = 0; k < kSpokes; ++k) {
    const double angle = 4 * std::numbers::pi * k / kSpokes;
    points.emplace_back(std::cos(angle), std::sin(angle), k % 2 == 0 ? 0.1 : 0.0);
    elements.push_back({0, k + 1, (k + 1) % kSpokes + 1});
  }
  const Triangles surface = to_triangles(points, elements);
  const Pairs found = self_intersections(surface);
  EXPECT_EQ(found, pairs_of_cgal(surface));
  EXPECT_FALSE(found.empty());
}

TEST(SelfIntersections, ChangedTrianglesAreThoseWithOtherCorners) {
  const Triangles before = sphere({0, 0, 0}, 1, 1);
  Triangles after = before;
  EXPECT_EQ(changed_triangles(before, after), std::vector<char>(32, 0));
  after.elements.row(4) << before.elements(4, 1), before.elements(4, 2), before.elements(4, 0);
  EXPECT_EQ(changed_triangles(before, after), std::vector<char>(32, 0));
  after.points(before.elements(7, 2), 0) += 1e-12;
  const auto changed = changed_triangles(before, after);
  for (int row = 0; row < 32; ++row)
    EXPECT_EQ(bool(changed[row]),
              (before.elements.row(row).array() == before.elements(7, 2)).any());
  after.elements.conservativeResize(34, 3);
  after.elements.bottomRows(2).setZero();
  EXPECT_EQ(changed_triangles(before, after).size(), 34u);
  EXPECT_EQ(changed_triangles(before, after).back(), 1);
}

TEST(SelfIntersections, AreAddedByAChangeThatMakesMoreOfThem) {
  const Triangles before = sphere({0, 0, 0}, 1, 3);
  Triangles after = before;
  after.points.row(0) *= 1.1;
  EXPECT_TRUE(added_intersections(before, after).empty());
  after.points.row(0) *= -1.1;
  EXPECT_FALSE(added_intersections(before, after).empty());
  EXPECT_TRUE(added_intersections(after, after).empty());
  EXPECT_TRUE(added_intersections(after, before).empty());
}

TEST(SelfIntersections, FindsTheOnlyPair) {
  const Triangles surface =
      to_triangles({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.5, 0.5, -1}, {0.5, 0.5, 1}, {5, 5, 0}},
                   {{0, 1, 2}, {3, 4, 5}});
  EXPECT_EQ(self_intersections(surface), (Pairs{{0, 1}}));
}

TEST(SelfIntersections, SeeAFoldAlongACommonEdge) {
  const std::vector<Vector<3>> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, -1, 0}};
  EXPECT_EQ(self_intersections(to_triangles(points, {{0, 1, 2}, {1, 0, 3}})), (Pairs{{0, 1}}));
  EXPECT_TRUE(self_intersections(to_triangles(points, {{0, 1, 2}, {1, 0, 4}})).empty());
}

TEST(SelfIntersections, SeeMoreThanACommonVertex) {
  const std::vector<Vector<3>> points = {{0, 0, 0}, {2, 0, 0},  {0, 2, 0},
                                         {1, 1, 1}, {1, 1, -1}, {-1, -1, 1}};
  EXPECT_EQ(self_intersections(to_triangles(points, {{0, 1, 2}, {0, 3, 4}})), (Pairs{{0, 1}}));
  EXPECT_TRUE(self_intersections(to_triangles(points, {{0, 1, 2}, {0, 3, 5}})).empty());
}

TEST(SelfIntersections, SeeATriangleThatIsThereTwice) {
  const std::vector<Vector<3>> points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  EXPECT_EQ(self_intersections(to_triangles(points, {{0, 1, 2}, {2, 1, 0}})), (Pairs{{0, 1}}));
}

TEST(SelfIntersections, AreTheSameTwice) {
  const Triangles surface = crumpled(0.6, 9);
  EXPECT_EQ(self_intersections(surface), self_intersections(surface));
}

}  // namespace
}  // namespace surf::mesh
