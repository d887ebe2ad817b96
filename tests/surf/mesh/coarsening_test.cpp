// coarsen() of libsurf/mesh/bisection.h: bisections undone.
#include <gtest/gtest.h>

#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <random>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

// ---- the inverse ----

/// All that a mesh is, with its half-edges.
struct Snapshot {
  Points<3> vertices;
  Elements<3> rows;
  std::vector<int> halfedges;

  explicit Snapshot(const TriMesh& mesh) : vertices(points(mesh)), rows(elements(mesh)) {
    for (const auto h : mesh.halfedges())
      for (const int index : {h.to().idx(), h.next().idx(), h.prev().idx(), h.face().idx()})
        halfedges.push_back(index);
    for (const auto vertex : mesh.vertices()) halfedges.push_back(vertex.halfedge().idx());
    for (const auto face : mesh.faces()) halfedges.push_back(face.halfedge().idx());
    for (const auto face : mesh.faces()) halfedges.push_back(refinement_edge(mesh, face).idx());
  }

  void expect_same_connectivity(const Snapshot& other) const {
    EXPECT_EQ(rows, other.rows);
    EXPECT_EQ(halfedges, other.halfedges);
  }
};

TEST(Coarsening, OfAllFacesUndoesRefiningAllBitForBit) {
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    mark_longest_edges(mesh);
    std::vector<Snapshot> before;
    std::vector<int> n_new;
    for (int round = 0; round < 4; ++round) {
      before.emplace_back(mesh);
      n_new.push_back(bisect(mesh, all_faces(mesh)));
    }
    for (int round = 3; round >= 0; --round) {
      EXPECT_EQ(coarsen(mesh, all_faces(mesh)), n_new[round]);
      check_mesh(mesh);
      const Snapshot after(mesh);
      EXPECT_EQ(after.vertices, before[round].vertices);
      after.expect_same_connectivity(before[round]);
    }
    EXPECT_EQ(coarsen(mesh, all_faces(mesh)), 0);
  }
}

// Elements that stand in for removed ones have other handles, but never those of the start.
TEST(Coarsening, LeadsBackToTheStartAfterAnyRefinementCoarseningAndMoves) {
  std::mt19937 random(11);
  for (int kind = 0; kind < 20; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    mark_longest_edges(mesh);
    const Snapshot before(mesh);
    int n_removed = 0;
    for (int round = 0; round < 6; ++round) {
      bisect(mesh, random_faces(mesh, 0.3, random));
      move(mesh, WavyField(random, 0.02));
      n_removed += coarsen(mesh, random_faces(mesh, 0.8, random));
      check_mesh(mesh);
    }
    EXPECT_GT(n_removed, 20);
    const Points<3> moved = points(mesh).topRows(before.vertices.rows());
    while (coarsen(mesh, all_faces(mesh)) > 0) check_mesh(mesh);
    Snapshot(mesh).expect_same_connectivity(before);
    EXPECT_EQ(points(mesh), moved);
  }
}

TEST(Coarsening, RemovesAVertexOnlyIfAllItsFacesAreMarkedAndThePredicateAllowsIt) {
  TriMesh mesh = to_mesh(some_surface(2));
  const auto n_start = mesh.n_vertices();
  const int n_new = bisect(mesh, all_faces(mesh));
  VertexHandle kept(static_cast<int>(n_start));
  while (!is_removable(mesh, kept)) kept = VertexHandle(kept.idx() + 1);
  std::vector<FaceHandle> marked = all_faces(mesh);
  std::erase(marked, FaceHandle(mesh.face_handle(mesh.halfedge_handle(kept))));
  TriMesh copy = mesh;
  EXPECT_EQ(coarsen(copy, marked), n_new - 1);
  check_mesh(copy);

  std::set<int> asked;
  const auto allow_even = [&](VertexHandle vertex) {
    EXPECT_TRUE(is_removable(mesh, vertex));
    EXPECT_TRUE(asked.insert(vertex.idx()).second) << "asked twice";
    return vertex.idx() % 2 == 0;
  };
  const auto before = mesh.n_vertices();
  const int n_removed = coarsen(mesh, all_faces(mesh), allow_even);
  check_mesh(mesh);
  EXPECT_EQ(mesh.n_vertices(), before - n_removed);
  EXPECT_GT(n_removed, 0);
  EXPECT_LT(n_removed, static_cast<int>(asked.size()));
  EXPECT_GE(*asked.begin(), static_cast<int>(n_start));
}

TEST(Coarsening, DoesNothingWithoutHistory) {
  TriMesh mesh = to_mesh(some_surface(1));
  EXPECT_EQ(coarsen(mesh, all_faces(mesh)), 0);
  EXPECT_FALSE(is_removable(mesh, VertexHandle(0)));
  bisect(mesh, all_faces(mesh));
  mark_longest_edges(mesh);
  EXPECT_EQ(coarsen(mesh, all_faces(mesh)), 0);
}

// A face keeps its ancestor's number, the halves of an edge their edge's.
TEST(Coarsening, AnyPropertyTravelsWithBisectionAndBack) {
  std::mt19937 random(12);
  TriMesh mesh = to_mesh(some_surface(0));
  auto of_face = OpenMesh::FProp<int>(-1, mesh);
  auto of_edge = OpenMesh::EProp<int>(-1, mesh);
  auto of_halfedge = OpenMesh::HProp<int>(-1, mesh);
  const auto set = [&] {
    for (const auto face : mesh.faces()) of_face[face] = face.idx();
    for (const auto edge : mesh.edges()) of_edge[edge] = edge.idx();
    for (const auto h : mesh.halfedges()) of_halfedge[h] = h.idx();
  };
  set();
  const TriMesh start = mesh;
  for (int round = 0; round < 5; ++round) bisect(mesh, random_faces(mesh, 0.3, random));
  std::vector<double> area(start.n_faces(), 0), length(start.n_edges(), 0);
  std::vector<double> length_one_way(start.n_halfedges(), 0);
  for (const auto face : mesh.faces()) area.at(of_face[face]) += mesh.calc_face_area(face);
  for (const auto edge : mesh.edges()) {
    if (of_edge[edge] <= 0) continue;  // inside of a face, or edge 0
    length.at(of_edge[edge]) += mesh.calc_edge_length(edge);
    for (const auto h : {edge.h0(), edge.h1()})
      length_one_way.at(of_halfedge[h]) += mesh.calc_edge_length(edge);
  }
  for (const auto face : start.faces())
    EXPECT_NEAR(area[face.idx()], start.calc_face_area(face), 1e-12);
  for (const auto edge : start.edges()) {
    if (edge.idx() == 0) continue;
    EXPECT_NEAR(length[edge.idx()], start.calc_edge_length(edge), 1e-12);
    EXPECT_NEAR(length_one_way[edge.h0().idx()], start.calc_edge_length(edge), 1e-12);
    EXPECT_NEAR(length_one_way[edge.h1().idx()], start.calc_edge_length(edge), 1e-12);
  }
  while (coarsen(mesh, all_faces(mesh)) > 0) check_mesh(mesh);
  for (const auto face : mesh.faces()) EXPECT_EQ(of_face[face], face.idx());
  for (const auto edge : mesh.edges()) EXPECT_EQ(of_edge[edge], edge.idx());
}

TEST(Coarsening, LocalMarksForgetTheBisectionsOfTheirVerticesOnly) {
  TriMesh mesh = to_mesh(some_surface(0));
  bisect(mesh, all_faces(mesh));
  std::vector<bool> could(mesh.n_vertices());
  for (const auto vertex : mesh.vertices()) could[vertex.idx()] = is_removable(mesh, vertex);
  const FaceHandle face(5);
  mark_longest_edges(mesh, std::vector{face});
  mark_longest_edges(mesh, std::vector{face});
  check_mesh(mesh);
  for (const auto vertex : mesh.vertices()) {
    const bool is_touched = std::any_of(mesh.cfv_begin(face), mesh.cfv_end(face),
                                        [&](VertexHandle other) { return other == vertex; });
    EXPECT_EQ(is_removable(mesh, vertex), could[vertex.idx()] && !is_touched);
  }
}

// Where a flip on the other side has joined the ends of a bisected edge, they would have two edges.
TEST(Coarsening, LeavesABisectionWhoseEdgeIsThereAgain) {
  enum { a, b, c, d, p, q };
  Triangles pillow;
  pillow.points.resize(6, 3);
  pillow.points << -1, 0, 0, 1, 0, 0, 0, 0.9, 0, 0, -0.9, 0, 0, 1.3, -0.1, 0, -1.3, -0.1;
  pillow.elements.resize(8, 3);
  pillow.elements << a, b, c, b, a, d, a, c, p, c, b, p, a, p, q, p, b, q, a, q, d, q, b, d;
  TriMesh mesh = to_mesh(pillow);
  mark_longest_edges(mesh);
  const std::vector<FaceHandle> front = {FaceHandle(0)};
  ASSERT_EQ(bisect(mesh, front), 1);
  ASSERT_TRUE(is_removable(mesh, VertexHandle(6)));
  const auto across = mesh.find_halfedge(VertexHandle(p), VertexHandle(q));
  const std::vector<FaceHandle> back = {mesh.face_handle(across),
                                        mesh.opposite_face_handle(across)};
  ASSERT_TRUE(mesh.is_flip_ok(mesh.edge_handle(across)));
  mesh.flip(mesh.edge_handle(across));
  mark_longest_edges(mesh, back);
  ASSERT_TRUE(mesh.find_halfedge(VertexHandle(a), VertexHandle(b)).is_valid());
  EXPECT_EQ(coarsen(mesh, all_faces(mesh)), 0);
  check_mesh(mesh);
}

}  // namespace
}  // namespace surf::mesh
