#include "libsurf/mesh/from_label_map.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

#include "libsurf/base/error.h"
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

/// Corner c of a cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge (axis, c) runs along the
/// axis from corner c, whose bit of that axis is 0.
struct CubeEdge {
  int axis, corner;
  Vector<3> middle() const {
    Vector<3> point(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    point[axis] = 0.5;
    return point;
  }
};

constexpr int kEdges = 24;  // axis * 8 + corner; half of them are not used
int edge_number(int corner, int other) {
  const int axis = (corner ^ other) >> 1;  // 1, 2, 4 -> 0, 1, 2
  return axis * 8 + std::min(corner, other);
}
CubeEdge edge_of(int number) { return {number / 8, number % 8}; }

bool in_one_face(int edge, int other) {
  const Vector<3> a = edge_of(edge).middle(), b = edge_of(other).middle();
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
                    angles_deg(edge_of(loop_[i]).middle(), edge_of(loop_[apex]).middle(),
                               edge_of(loop_[j]).middle())
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

/// Walks through the volume by pairs of slices, with a border of one voxel outside all round.
class March {
 public:
  March(const volume::Volume& labels, std::optional<int> label)
      : labels_(labels),
        label_(label),
        nx_(labels.size()[0] + 2),
        ny_(labels.size()[1] + 2),
        values_(std::size_t(labels.size()[0]) * labels.size()[1]) {
    for (auto& slice : inside_) slice.assign(std::size_t(nx_) * ny_, 0);
    for (auto& vertices : vertex_) vertices.assign(std::size_t(nx_) * ny_, -1);
  }

  Triangles run() {
    for (int k = 0; k <= labels_.size()[2]; ++k) {  // slices k-1 and k
      std::swap(inside_[0], inside_[1]);
      std::swap(is_empty_[0], is_empty_[1]);
      load_slice(k);
      if (is_empty_[0] && is_empty_[1]) continue;
      // Edges within the lower slice keep the vertices they got as the upper one.
      std::swap(vertex_[0], vertex_[3]);
      std::swap(vertex_[1], vertex_[4]);
      for (const int fresh : {2, 3, 4}) std::fill(vertex_[fresh].begin(), vertex_[fresh].end(), -1);
      for (int j = 0; j + 1 < ny_; ++j)
        for (int i = 0; i + 1 < nx_; ++i) add_cube(i, j, k);
    }
    return result();
  }

 private:
  void load_slice(int k) {
    const auto& size = labels_.size();
    is_empty_[1] = true;
    std::fill(inside_[1].begin(), inside_[1].end(), 0);
    if (k == size[2]) return;
    labels_.copy_box({0, 0, k}, {size[0], size[1], k + 1}, values_.data());
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (is_labelled(values_[std::size_t(j) * size[0] + i], label_)) {
          inside_[1][std::size_t(j + 1) * nx_ + i + 1] = 1;
          is_empty_[1] = false;
        }
  }

  void add_cube(int i, int j, int k) {
    const std::size_t at = std::size_t(j) * nx_ + i;
    const auto pair = [&](int slice, std::size_t row) {
      return inside_[slice][row] | inside_[slice][row + 1] << 1;
    };
    const int mask =
        pair(0, at) | pair(0, at + nx_) << 2 | pair(1, at) << 4 | pair(1, at + nx_) << 6;
    if (mask == 0 || mask == 255) return;
    for (const Edges3& triangle : cube_table()[mask])
      elements_.push_back({vertex_on(triangle[0], i, j, k), vertex_on(triangle[1], i, j, k),
                           vertex_on(triangle[2], i, j, k)});
  }

  /// The vertex on an edge of the cube, whose corner 0 is at (i - 1, j - 1, k - 1).
  int vertex_on(int edge, int i, int j, int k) {
    const auto [axis, corner] = edge_of(edge);
    const std::size_t at = std::size_t(j + (corner >> 1 & 1)) * nx_ + i + (corner & 1);
    int& vertex = vertex_[axis == 2 ? 2 : axis + 3 * (corner >> 2)][at];
    if (vertex < 0) {
      vertex = static_cast<int>(points_.size());
      const Vector<3> index = Vector<3>(i - 1, j - 1, k - 1) + edge_of(edge).middle();
      points_.push_back(labels_.index_to_world() * index);
    }
    return vertex;
  }

  Triangles result() const {
    if (elements_.empty())
      throw InputError(
          label_ ? fmt::format("{}: no voxel has the label {}", labels_.source().path, *label_)
                 : fmt::format("{}: all voxels are 0", labels_.source().path));
    Triangles surface;
    surface.points.resize(static_cast<Eigen::Index>(points_.size()), 3);
    surface.elements.resize(static_cast<Eigen::Index>(elements_.size()), 3);
    for (std::size_t i = 0; i < points_.size(); ++i)
      surface.points.row(static_cast<Eigen::Index>(i)) = points_[i].transpose();
    for (std::size_t i = 0; i < elements_.size(); ++i)
      surface.elements.row(static_cast<Eigen::Index>(i)) =
          Eigen::RowVector3i::Map(elements_[i].data());
    if (labels_.index_to_world().linear().determinant() < 0)
      surface.elements.col(1).swap(surface.elements.col(2));
    return surface;
  }

  const volume::Volume& labels_;
  std::optional<int> label_;
  int nx_, ny_;
  std::vector<float> values_;
  std::array<std::vector<std::uint8_t>, 2> inside_;  // lower and upper slice
  std::array<bool, 2> is_empty_{true, true};
  /// Vertices on the edges along x and y of the lower slice (0, 1), along z (2), and along x
  /// and y of the upper slice (3, 4), by the edge's first voxel; -1 where there is none yet.
  std::array<std::vector<int>, 5> vertex_;
  std::vector<Vector<3>> points_;
  std::vector<std::array<int, 3>> elements_;
};

}  // namespace

Triangles surface_of_label_map(const volume::Volume& labels, std::optional<int> label) {
  return March(labels, label).run();
}

}  // namespace surf::mesh
