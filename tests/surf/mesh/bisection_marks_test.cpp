#include "libsurf/mesh/detail/bisection_marks.h"

#include <gtest/gtest.h>

#include "libsurf/mesh/bisection.h"
#include "tests/surf/mesh/check_shapes.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

double length(const TriMesh& mesh, HalfedgeHandle h) {
  return (mesh.point(mesh.to_vertex_handle(h)) - mesh.point(mesh.from_vertex_handle(h))).norm();
}

/// With refinement edges; the first face has been bisected, and its vertex is the last one.
TriMesh bisected(const Triangles& surface) {
  TriMesh mesh = to_mesh(surface);
  mark_longest_edges(mesh);
  EXPECT_EQ(bisect(mesh, std::vector{FaceHandle(0)}), 1);
  return mesh;
}

VertexHandle newest(const TriMesh& mesh) { return VertexHandle(int(mesh.n_vertices()) - 1); }

TEST(BisectionMarks, AreAllThereOrNone) {
  TriMesh mesh = to_mesh(test::tetrahedron());
  EXPECT_FALSE(find_marks(mesh).exist());
  mark_longest_edges(mesh);
  const Marks marks = find_marks(mesh);
  EXPECT_TRUE(marks.exist() && marks.birth.is_valid() && marks.n_calls.is_valid());
  clear_refinement_edges(mesh);
  EXPECT_FALSE(find_marks(mesh).exist());
}

TEST(BisectionMarks, RankOrdersByLengthAndTakesBothDirectionsForOne) {
  const TriMesh mesh = to_mesh(some_surface(1));
  for (const auto edge : mesh.edges()) {
    const auto h = mesh.halfedge_handle(edge, 0), o = mesh.halfedge_handle(edge, 1);
    EXPECT_EQ(rank(mesh, h), rank(mesh, o));
  }
  for (const auto face : mesh.faces()) {
    const HalfedgeHandle longest = longest_edge(mesh, face);
    EXPECT_EQ(mesh.face_handle(longest), face);
    for (const auto h : mesh.fh_range(face))
      EXPECT_LE(length(mesh, h), length(mesh, longest) * (1 + 1e-7));  // floats are compared
  }
}

// Equal lengths: the larger pair of vertices, so that two faces at an edge agree.
TEST(BisectionMarks, TiesGoByThePairOfVertices) {
  const TriMesh mesh = to_mesh(test::tetrahedron());
  const HalfedgeHandle longest = longest_edge(mesh, FaceHandle(3));  // 1, 2, 3, all sides sqrt(2)
  EXPECT_EQ(mesh.from_vertex_handle(longest).idx() + mesh.to_vertex_handle(longest).idx(), 2 + 3);
}

TEST(BisectionMarks, TheNewestVertexIsAcrossTheRefinementEdge) {
  TriMesh mesh = bisected(some_surface(0));
  const Marks marks = find_marks(mesh);
  for (const FaceHandle face : mesh.vf_range(newest(mesh)))
    EXPECT_EQ(newest_vertex(mesh, marks, face), newest(mesh));
}

TEST(BisectionMarks, FourSpokesAreAClosedFan) {
  const Triangles octahedron = test::sphere({0, 0, 0}, 1, 0);
  const TriMesh mesh = to_mesh(octahedron);
  for (const auto vertex : mesh.vertices()) {
    const auto star = four_spokes(mesh, mesh.halfedge_handle(vertex));
    ASSERT_TRUE(star);
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(mesh.from_vertex_handle(star->spoke[k]), vertex);
      EXPECT_EQ(mesh.from_vertex_handle(star->rim[k]), mesh.to_vertex_handle(star->spoke[k]));
      EXPECT_EQ(mesh.to_vertex_handle(star->rim[k]),
                mesh.to_vertex_handle(star->spoke[(k + 1) % 4]));
    }
  }
  const TriMesh three = to_mesh(test::tetrahedron());
  EXPECT_FALSE(four_spokes(three, three.halfedge_handle(VertexHandle(0))));
  const TriMesh five = to_mesh(ball({0, 0, 0}, 1, 2));  // an icosahedron
  EXPECT_FALSE(four_spokes(five, five.halfedge_handle(VertexHandle(0))));
}

TEST(BisectionMarks, ChildrenRunFromOneEndOfTheHalvedEdgeToTheOther) {
  TriMesh mesh = bisected(some_surface(0));
  const Marks marks = find_marks(mesh);
  const auto star = children(mesh, marks, newest(mesh));
  ASSERT_TRUE(star);
  const auto [a, b] = bisected_edge(mesh, newest(mesh));
  EXPECT_EQ(mesh.to_vertex_handle(star->spoke[0]), b);
  EXPECT_EQ(mesh.to_vertex_handle(star->spoke[2]), a);
  const Eigen::Vector3d middle = (mesh.point(a) + mesh.point(b)) / 2;
  EXPECT_LT((mesh.point(newest(mesh)) - middle).norm(), 1e-15);
  EXPECT_FALSE(children(mesh, marks, VertexHandle(0)));
}

TEST(BisectionMarks, AnotherRefinementEdgeMakesTheVerticesForget) {
  TriMesh mesh = bisected(some_surface(0));
  const Marks marks = find_marks(mesh);
  const VertexHandle vertex = newest(mesh);
  EXPECT_TRUE(is_removable(mesh, vertex));
  const FaceHandle child = *mesh.cvf_iter(vertex);
  const HalfedgeHandle old = refinement_edge(mesh, child);
  mark(mesh, marks, child, mesh.next_halfedge_handle(old));
  EXPECT_EQ(refinement_edge(mesh, child), mesh.next_halfedge_handle(old));
  EXPECT_FALSE(is_removable(mesh, vertex));
  // Back again: what was forgotten does not come back.
  mark(mesh, marks, child, old);
  EXPECT_FALSE(is_removable(mesh, vertex));
}

TEST(BisectionMarks, GrandchildrenHideTheChildren) {
  TriMesh mesh = bisected(some_surface(0));
  const VertexHandle vertex = newest(mesh);
  const FaceHandle child = *mesh.cvf_iter(vertex);
  bisect(mesh, std::vector{child});
  EXPECT_FALSE(is_removable(mesh, vertex));
  EXPECT_TRUE(is_removable(mesh, newest(mesh)));
}

}  // namespace
}  // namespace surf::mesh
