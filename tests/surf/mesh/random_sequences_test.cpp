// Random sequences of all operations on random closed surfaces: every invariant after each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/improve.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 1e-12;  // relative; a few thousand terms of rounding eps

int euler_number(const TriMesh& mesh) {
  return static_cast<int>(mesh.n_vertices()) - static_cast<int>(mesh.n_edges()) +
         static_cast<int>(mesh.n_faces());
}

struct Interval {
  double low = 0, high = 0;
  void add(double a, double b) {
    low += std::min(a, b);
    high += std::max(a, b);
  }
};

/// By how much area and volume may change.
struct Allowed {
  Interval area, volume;
};

constexpr Interval kAnything{-1e9, 1e9};
constexpr Allowed kNothing{};
constexpr Allowed kBoth{.area = kAnything, .volume = kAnything};

// ---- the bound on angles of bisection ----

/// Smallest angle of the triangle and all that bisection makes of it: three generations hold
/// all similarity classes. The refinement edge is pq.
double smallest_angle_below(const Vector3d& newest, const Vector3d& p, const Vector3d& q,
                            int generations = 3) {
  const double angle = std::acos(std::min(1.0, angle_cosines(newest, p, q).sharpest));
  if (generations == 0) return angle;
  const Vector3d middle = 0.5 * (p + q);
  return std::min({angle, smallest_angle_below(middle, newest, p, generations - 1),
                   smallest_angle_below(middle, q, newest, generations - 1)});
}

double smallest_angle_below(const TriMesh& mesh, FaceHandle face) {
  const HalfedgeHandle edge = refinement_edge(mesh, face);
  return smallest_angle_below(mesh.point(mesh.to_vertex_handle(mesh.next_halfedge_handle(edge))),
                              mesh.point(mesh.from_vertex_handle(edge)),
                              mesh.point(mesh.to_vertex_handle(edge)));
}

/// Whether a walk across refinement edges comes back, so that bisection would change one.
bool has_cycle(const TriMesh& mesh) {
  std::vector<int> visited_from(mesh.n_faces(), -1);
  for (const auto start : mesh.faces()) {
    FaceHandle face = start;
    while (visited_from[face.idx()] < 0) {
      visited_from[face.idx()] = start.idx();
      const HalfedgeHandle opposite = mesh.opposite_halfedge_handle(refinement_edge(mesh, face));
      const FaceHandle neighbour = mesh.face_handle(opposite);
      if (refinement_edge(mesh, neighbour) == opposite) break;
      if (visited_from[neighbour.idx()] == start.idx()) return true;
      face = neighbour;
    }
  }
  return false;
}

// ---- operations ----

Allowed refine(TriMesh& mesh, std::mt19937& random) {
  if (!has_refinement_edges(mesh)) mark_longest_edges(mesh);
  const bool is_bounded = !has_cycle(mesh);
  {
    auto bound = OpenMesh::FProp<double>(mesh);  // children get that of their parent
    for (const auto face : mesh.faces()) bound[face] = smallest_angle_below(mesh, face);
    const auto n_before = mesh.n_faces();
    const int n_new = bisect(mesh, random_faces(mesh, 0.15, random));
    EXPECT_EQ(mesh.n_faces(), n_before + 2 * n_new);
    for (const auto face : mesh.faces()) {
      EXPECT_GT(bound[face], 0) << "a child has not got its parent's properties";
      if (is_bounded) {
        EXPECT_GE(std::acos(angle_cosines(mesh, face).sharpest), bound[face] * (1 - 1e-6));
      }
    }
  }
  return kNothing;
}

/// What removing a vertex with four triangles does, for both ways to cut the hole in two.
void add_removal(const TriMesh& mesh, VertexHandle vertex, Allowed& allowed) {
  std::vector<Vector3d> rim;  // from the vertex
  for (const HalfedgeHandle spoke : mesh.voh_ccw_range(vertex))
    rim.push_back(mesh.point(mesh.to_vertex_handle(spoke)) - mesh.point(vertex));
  ASSERT_EQ(rim.size(), 4u);
  std::array<double, 2> area{}, volume{};
  for (int cut = 0; cut < 2; ++cut) {
    for (int k = 0; k < 4; ++k) area[cut] -= 0.5 * rim[k].cross(rim[(k + 1) % 4]).norm();
    for (const int k : {cut, cut + 2}) {
      const Vector3d &a = rim[k], &b = rim[(k + 1) % 4], &c = rim[(k + 2) % 4];
      area[cut] += 0.5 * (b - a).cross(c - a).norm();
      volume[cut] += a.dot(b.cross(c)) / 6;
    }
  }
  allowed.area.add(area[0], area[1]);
  allowed.volume.add(volume[0], volume[1]);
}

Allowed coarsen_random_faces(TriMesh& mesh, std::mt19937& random) {
  Allowed allowed;
  const auto n_before = mesh.n_faces();
  const int n_removed = coarsen(mesh, random_faces(mesh, 0.9, random), [&](VertexHandle vertex) {
    add_removal(mesh, vertex, allowed);
    return true;
  });
  EXPECT_EQ(mesh.n_faces(), n_before - 2 * n_removed);
  return allowed;
}

Allowed mark(TriMesh& mesh) {
  mark_longest_edges(mesh);
  for (const auto face : mesh.faces()) {
    const double angle = std::acos(angle_cosines(mesh, face).sharpest);
    EXPECT_GE(smallest_angle_below(mesh, face), 0.5 * angle * (1 - 1e-6));
  }
  return kNothing;
}

/// Local marks, and then those of the worst case: a walk round each of some vertices.
Allowed mark_cycles(TriMesh& mesh, std::mt19937& random) {
  if (!has_refinement_edges(mesh)) return kNothing;
  mark_longest_edges(mesh, random_faces(mesh, 0.1, random));
  OpenMesh::FProp<HalfedgeHandle> edge(mesh, "surf:refinement_edge");
  std::bernoulli_distribution is_centre(0.02);
  for (const auto vertex : mesh.vertices()) {
    if (!is_centre(random)) continue;
    const std::vector<FaceHandle> star(mesh.cvf_begin(vertex), mesh.cvf_end(vertex));
    mark_longest_edges(mesh, star);
    for (const auto spoke : mesh.voh_range(vertex)) edge[spoke.face()] = spoke;
  }
  return kNothing;
}

Allowed do_something(TriMesh& mesh, int what, std::mt19937& random) {
  switch (what) {
    case 0:
    case 1:
      return refine(mesh, random);
    case 2:
    case 3:
      return coarsen_random_faces(mesh, random);
    case 4:
      return mark(mesh);
    case 5:
      move(mesh, WavyField(random, 0.05));
      return kBoth;
    case 6:
      refine_long_edges(mesh, 0.4);
      return kNothing;
    case 7:
      return mark_cycles(mesh, random);
    default:
      improve(mesh, {.min_length = 0.1, .max_length = 0.5, .tolerance_mm = 0.03});
      return kBoth;
  }
}

void expect_change_within(double now, double before, const Interval& allowed) {
  EXPECT_GE(now - before, allowed.low - kTolerance * before);
  EXPECT_LE(now - before, allowed.high + kTolerance * before);
}

TEST(RandomSequences, KeepEveryInvariant) {
  constexpr int kSequences = 200, kOperations = 12, kKinds = 9;
  std::mt19937 random(2024);
  std::uniform_int_distribution<int> operation(0, kKinds - 1);
  int n_removed = 0, n_with_cycle = 0;
  for (int sequence = 0; sequence < kSequences; ++sequence) {
    TriMesh mesh = to_mesh(some_surface(sequence));
    const int euler = euler_number(mesh);
    for (int step = 0; step < kOperations; ++step) {
      const double area = surface_area(mesh), volume = enclosed_volume(mesh);
      const auto n_vertices = mesh.n_vertices();
      const int what = operation(random);
      SCOPED_TRACE(fmt::format("sequence {}, step {}, operation {}", sequence, step, what));
      const Allowed allowed = do_something(mesh, what, random);
      ASSERT_NO_THROW(check_mesh(mesh));
      ASSERT_EQ(euler_number(mesh), euler);
      expect_change_within(surface_area(mesh), area, allowed.area);
      expect_change_within(enclosed_volume(mesh), volume, allowed.volume);
      if (what == 2 || what == 3) n_removed += static_cast<int>(n_vertices - mesh.n_vertices());
      n_with_cycle += has_refinement_edges(mesh) && has_cycle(mesh);
    }
  }
  // The sequences are such that something is undone and that the closure has cycles to break.
  EXPECT_GT(n_removed, 1000);
  EXPECT_GT(n_with_cycle, 10);
}

}  // namespace
}  // namespace surf::mesh
