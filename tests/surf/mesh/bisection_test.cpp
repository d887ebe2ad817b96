#include "libsurf/mesh/bisection.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <chrono>
#include <random>
#include <set>
#include <vector>

#include "libsurf/base/error.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

TEST(Bisection, OfACompatiblePairHalvesItsEdge) {
  TriMesh mesh = to_mesh(box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), 1));
  const FaceHandle face(0);
  mark_longest_edges(mesh);
  EXPECT_EQ(bisect(mesh, std::vector{face}), 1);
  check_mesh(mesh);
  EXPECT_EQ(mesh.n_faces(), 14u);
  const VertexHandle vertex(8);
  const auto offsets = (mesh.point(vertex).array() - 0.5).abs();
  EXPECT_EQ(offsets.maxCoeff(), 0.5);  // centre of a side of the unit cube
  EXPECT_EQ(offsets.sum(), 0.5);
}

TEST(Bisection, KeepsAreaAndVolumeAndEveryInvariantForRandomMarks) {
  std::mt19937 random(1);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    const double area = surface_area(mesh), volume = enclosed_volume(mesh);
    for (int round = 0; round < 8; ++round) {
      const auto n_faces = mesh.n_faces();
      const auto marked = random_faces(mesh, 0.1, random);
      const int n_new = bisect(mesh, marked);
      EXPECT_EQ(mesh.n_faces(), n_faces + 2 * n_new);
      EXPECT_GE(2 * n_new, static_cast<int>(marked.size()));
      check_mesh(mesh);
      EXPECT_NEAR(surface_area(mesh), area, 1e-13 * area);
      EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-13 * volume);
    }
  }
}

TEST(Bisection, OfAllFacesHalvesEachAtLeastOnceAndOnceWhereAllAreCompatible) {
  // Every diagonal of the cube's sides is shared by both of its triangles.
  TriMesh mesh = to_mesh(box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), 0.25));
  const auto n_faces = mesh.n_faces();
  bisect(mesh, all_faces(mesh));
  check_mesh(mesh);
  EXPECT_EQ(mesh.n_faces(), 2 * n_faces);
  bisect(mesh, all_faces(mesh));
  EXPECT_EQ(mesh.n_faces(), 4 * n_faces);
  EXPECT_NEAR(min_angle_deg(mesh), 45, 1e-9);
}

// Rosenberg and Stenger: bisecting at longest edges first, later at the newest vertex, no angle
// falls below half of the smallest one.
TEST(Bisection, KeepsAnglesAboveHalfOfTheSmallestAtTheStart) {
  std::mt19937 random(2);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    move(mesh, WavyField(random, 0.1));
    const double at_start = min_angle_deg(mesh);
    for (int round = 0; round < 12; ++round) bisect(mesh, random_faces(mesh, 0.2, random));
    EXPECT_GE(min_angle_deg(mesh), 0.5 * at_start * (1 - 1e-9));
  }
}

/// The face of the start that each face is a part of.
class Ancestors {
 public:
  explicit Ancestors(TriMesh& mesh) : mesh_(mesh), ancestor_(-1, mesh) {
    for (const auto face : mesh.faces()) ancestor_[face] = face.idx();
  }

  /// Faces on both sides of a bisector are sisters; one of them has its parent's handle.
  void inherit(VertexHandle vertex, VertexHandle a, VertexHandle b) {
    for (const auto spoke : mesh_.voh_range(vertex)) {
      if (spoke.to() == a || spoke.to() == b) continue;
      const int parent = std::max(ancestor_[spoke.face()], ancestor_[spoke.opp().face()]);
      ancestor_[spoke.face()] = ancestor_[spoke.opp().face()] = parent;
    }
  }

  int operator[](FaceHandle face) const { return ancestor_[face]; }

 private:
  TriMesh& mesh_;
  OpenMesh::FProp<int> ancestor_;
};

TEST(Bisection, MakesAtMostFourSimilarityClassesOfATriangle) {
  TriMesh mesh = to_mesh(some_surface(1));
  Ancestors ancestors(mesh);
  const int n_start = static_cast<int>(mesh.n_faces());
  const BisectionHook hook = [&](VertexHandle vertex, VertexHandle a, VertexHandle b) {
    ancestors.inherit(vertex, a, b);
  };
  std::mt19937 random(3);
  for (int round = 0; round < 8; ++round) bisect(mesh, random_faces(mesh, 0.3, random), hook);

  std::vector<std::set<std::pair<long, long>>> classes(n_start);
  const Points<3> angles = angles_deg(mesh);
  constexpr double kResolution = 1e-6;  // degrees; rounding of angles is below 1e-10
  for (const auto face : mesh.faces()) {
    ASSERT_GE(ancestors[face], 0);
    const auto row = angles.row(face.idx());
    classes[ancestors[face]].emplace(std::lround(row.minCoeff() / kResolution),
                                     std::lround(row.maxCoeff() / kResolution));
  }
  const auto n_most = std::max_element(classes.begin(), classes.end(), [](auto& l, auto& r) {
                        return l.size() < r.size();
                      })->size();
  EXPECT_LE(n_most, 4u);
  EXPECT_GE(n_most, 2u);
}

TEST(Bisection, HookCarriesAnyPropertyOfTheVertices) {
  TriMesh mesh = to_mesh(some_surface(3));
  auto value = OpenMesh::VProp<double>(mesh);
  const auto linear = [](const Eigen::Vector3d& x) { return 3 * x[0] - x[1] + 0.5 * x[2]; };
  for (const auto vertex : mesh.vertices()) value[vertex] = linear(mesh.point(vertex));
  const int n_new =
      refine_long_edges(mesh, 0.1, [&](VertexHandle vertex, VertexHandle a, VertexHandle b) {
        value[vertex] = 0.5 * (value[a] + value[b]);
      });
  EXPECT_GT(n_new, 100);
  for (const auto vertex : mesh.vertices())
    EXPECT_NEAR(value[vertex], linear(mesh.point(vertex)), 1e-13);
}

TEST(Bisection, RefinesLongEdgesUntilThereIsNone) {
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    const double area = surface_area(mesh);
    EXPECT_GT(longest_edge(mesh), 0.07);
    EXPECT_GT(refine_long_edges(mesh, 0.07), 0);
    check_mesh(mesh);
    EXPECT_LE(longest_edge(mesh), 0.07);
    EXPECT_NEAR(surface_area(mesh), area, 1e-12 * area);
    EXPECT_EQ(refine_long_edges(mesh, 0.07), 0);
  }
}

TEST(Bisection, IsTheSameTwice) {
  const auto refined = [] {
    std::mt19937 random(5);
    TriMesh mesh = to_mesh(some_surface(2));
    for (int round = 0; round < 5; ++round) bisect(mesh, random_faces(mesh, 0.2, random));
    return to_triangles(mesh);
  };
  EXPECT_EQ(refined().points, refined().points);
  EXPECT_EQ(refined().elements, refined().elements);
}

TEST(Bisection, CheckFindsARefinementEdgeOfAnotherFace) {
  TriMesh mesh = to_mesh(some_surface(0));
  mark_longest_edges(mesh);
  EXPECT_NO_THROW(check_mesh(mesh));
  OpenMesh::FProp<HalfedgeHandle> edge(mesh, "surf:refinement_edge");
  edge[FaceHandle(3)] = mesh.halfedge_handle(FaceHandle(4));
  EXPECT_THROW(check_mesh(mesh), InvalidMesh);
  clear_refinement_edges(mesh);
  EXPECT_FALSE(has_refinement_edges(mesh));
  EXPECT_NO_THROW(check_mesh(mesh));
}

TEST(Bisection, CheckAcceptsAndClosureBreaksACircleOfRefinementEdges) {
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    mark_longest_edges(mesh);
    OpenMesh::FProp<HalfedgeHandle> edge(mesh, "surf:refinement_edge");
    const VertexHandle centre(20);
    for (const auto spoke : mesh.voh_range(centre)) edge[spoke.face()] = spoke;
    EXPECT_NO_THROW(check_mesh(mesh));
    const double area = surface_area(mesh);
    bisect(mesh, all_faces(mesh));
    check_mesh(mesh);
    EXPECT_NEAR(surface_area(mesh), area, 1e-13 * area);
  }
}

// Any marks at all, so many circles of all lengths.
TEST(Bisection, EndsFromRandomRefinementEdges) {
  std::mt19937 random(9);
  std::uniform_int_distribution<int> corner(0, 2);
  for (int kind = 0; kind < 40; ++kind) {
    TriMesh mesh = to_mesh(some_surface(kind));
    mark_longest_edges(mesh);
    OpenMesh::FProp<HalfedgeHandle> edge(mesh, "surf:refinement_edge");
    for (const auto face : mesh.faces()) {
      edge[face] = mesh.halfedge_handle(face);
      for (int k = corner(random); k > 0; --k) edge[face] = mesh.next_halfedge_handle(edge[face]);
    }
    const double area = surface_area(mesh);
    const auto n_faces = mesh.n_faces();
    for (int round = 0; round < 3; ++round) bisect(mesh, all_faces(mesh));
    check_mesh(mesh);
    EXPECT_GE(mesh.n_faces(), 8 * n_faces);
    EXPECT_NEAR(surface_area(mesh), area, 1e-13 * area);
  }
}

TEST(Bisection, TimePerTriangleIsPrinted) {
  using Clock = std::chrono::steady_clock;
  for (const double edge_length : {0.02, 0.01}) {
    TriMesh mesh = to_mesh(ball(Eigen::Vector3d::Zero(), 1, edge_length));
    const auto start = Clock::now();
    mark_longest_edges(mesh);
    const int n_new = bisect(mesh, all_faces(mesh));
    const std::chrono::duration<double> time = Clock::now() - start;
    EXPECT_GT(n_new, 0);
    std::printf("%zu triangles after bisection of all: %.3f s, %.0f ns for each\n", mesh.n_faces(),
                time.count(), 1e9 * time.count() / static_cast<double>(mesh.n_faces()));
  }
}

}  // namespace
}  // namespace surf::mesh
