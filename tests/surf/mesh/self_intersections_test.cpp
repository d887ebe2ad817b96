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
  for (const auto& [a, b] : found) result.push_back(std::minmax<int>(int(a), int(b)));
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
