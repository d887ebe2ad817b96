#include "libsurf/mesh/marching_cubes.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "libsurf/mesh/measure.h"

// Marching cubes with tables made by rule instead of by hand. On each face of a cube, every run of
// inside corners is cut off by one segment, from the edge where the (counter-clockwise, seen
// from outside the cube) way round the face enters the run to the edge where it leaves it. The
// rule looks at the face alone, so that both its cubes draw the same segments, in
// opposite directions; and it separates corners that touch diagonally. Segments chain to loops
// round the inside corners. A loop is filled with triangles none of whose diagonals lies in a
// face of the cube: so cubes meet in their segments only, and the surface is manifold
// and embedded (the classic tables break this rule where both diagonals of a face are used).
namespace surf::mesh {
namespace {

constexpr int kEdges = 24;  // axis * 8 + corner; half of them are not used

int edge_number(int corner, int other) {
  const int axis = (corner ^ other) >> 1;  // 1, 2, 4 -> 0, 1, 2
  return axis * 8 + std::min(corner, other);
}
bool in_one_face(int edge, int other) {
  const Vector<3> a = cube_edge(edge).middle(), b = cube_edge(other).middle();
  for (int axis = 0; axis < 3; ++axis)
    if (a[axis] == b[axis] && a[axis] != 0.5) return true;
  return false;
}

/// Corners of the six faces, counter-clockwise seen from outside the cube.
std::array<std::array<int, 4>, 6> faces() {
  std::array<std::array<int, 4>, 6> result;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = 1 << axis, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
    result[2 * axis] = {0, v, u + v, u};
    result[2 * axis + 1] = {n, n + u, n + u + v, n + v};
  }
  return result;
}

using Loop = std::vector<int>;  // edges

std::vector<Loop> loops_of(int mask) {
  const auto is_inside = [&](int corner) { return (mask >> corner & 1) != 0; };
  std::array<int, kEdges> next;
  next.fill(-1);
  for (const auto& face : faces())
    for (int at = 0; at < 4; ++at) {
      if (is_inside(face[at]) || !is_inside(face[(at + 1) % 4])) continue;
      int end = at + 1;
      while (is_inside(face[(end + 1) % 4])) ++end;
      next[edge_number(face[at], face[(at + 1) % 4])] =
          edge_number(face[end % 4], face[(end + 1) % 4]);
    }
  std::vector<Loop> loops;
  for (int first = 0; first < kEdges; ++first) {
    Loop loop;
    for (int edge = first; next[edge] >= 0;) {
      loop.push_back(edge);
      edge = std::exchange(next[edge], -1);
    }
    if (!loop.empty()) loops.push_back(loop);
  }
  return loops;
}

using Edges3 = std::array<int, 3>;

/// Fills loops by the triangulation whose worst angle is best.
class Filling {
 public:
  explicit Filling(const Loop& loop) : loop_(loop) {}

  void append_to(std::vector<Edges3>& triangles) const {
    const int n = static_cast<int>(loop_.size());
    [[maybe_unused]] const bool is_filled = best(0, n - 1).worst_angle > 0;
    assert(is_filled && "a loop without a triangulation off the cube's faces");
    append(0, n - 1, triangles);
  }

 private:
  struct Choice {
    double worst_angle;
    int apex;
  };
  bool is_diagonal(int i, int j) const {
    return j - i > 1 && j - i < static_cast<int>(loop_.size()) - 1;
  }
  /// Of the part of the loop between its vertices i < j, closed by the diagonal between them.
  Choice best(int i, int j) const {
    if (j - i < 2) return {180, -1};
    if (is_diagonal(i, j) && in_one_face(loop_[i], loop_[j])) return {-1, -1};
    Choice choice{-1, -1};
    for (int apex = i + 1; apex < j; ++apex) {
      const double angle =
          std::min({best(i, apex).worst_angle, best(apex, j).worst_angle,
                    angles_deg(cube_edge(loop_[i]).middle(), cube_edge(loop_[apex]).middle(),
                               cube_edge(loop_[j]).middle())
                        .minCoeff()});
      if (angle > choice.worst_angle + 1e-9) choice = {angle, apex};
    }
    return choice;
  }
  void append(int i, int j, std::vector<Edges3>& triangles) const {
    if (j - i < 2) return;
    const int apex = best(i, j).apex;
    triangles.push_back({loop_[i], loop_[apex], loop_[j]});
    append(i, apex, triangles);
    append(apex, j, triangles);
  }

  const Loop& loop_;
};

/// Triangles of each of the 256 masks of inside corners, as triples of edges.
const std::array<std::vector<Edges3>, 256>& cube_table() {
  static const auto table = [] {
    std::array<std::vector<Edges3>, 256> result;
    for (int mask = 0; mask < 256; ++mask)
      for (const Loop& loop : loops_of(mask)) Filling(loop).append_to(result[mask]);
    return result;
  }();
  return table;
}

}  // namespace

const std::vector<std::array<int, 3>>& cube_triangles(int inside) { return cube_table()[inside]; }

}  // namespace surf::mesh
