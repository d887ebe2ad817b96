// Where the lines of a grid cross a triangle surface: what label maps and winding numbers on
// grids are made of.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Smallest integer >= x, within [0, n].
inline int first_index(double x, int n) {
  if (!(x > 0)) return 0;
  return x >= n ? n : static_cast<int>(std::ceil(x));
}

/// Finds the crossings of triangles with the lines along i of a grid.
///
/// Exact up to rounding of the crossings' coordinates (1e-15 of the size), and never inconsistent:
/// every crossing of an edge with a grid plane is one number for both its triangles, all
/// comparisons are half-open, so a line enters a closed surface as often as it leaves it, through
/// vertices and edges too.
class GridCrossings {
 public:
  /// @param points  in the grid's indices
  /// @param size    lines: 0 <= j < size[1], 0 <= k < size[2]; kept by the caller
  GridCrossings(const Points<3>& points, const std::array<int, 3>& size)
      : points_(points), size_(size) {}

  /// Calls visit(i, j, k, sign) for each crossing of the lines with a triangle, i a double of any
  /// size: sign is +1 where a line along +i enters an outward surface, -1 where it leaves it.
  template <class Visit>
  void visit_triangle(const Eigen::Ref<const Eigen::RowVector3i>& triangle,
                      const Visit& visit) const {
    const auto [low, high] =
        std::minmax({points_(triangle[0], 2), points_(triangle[1], 2), points_(triangle[2], 2)});
    const int first = first_index(low, size_[2]), last = first_index(high, size_[2]);
    for (int k = first; k < last; ++k) visit_section(triangle, k, visit);
  }

 private:
  /// An end of a triangle's section with the plane of constant k.
  struct SectionEnd {
    double i, j;
  };

  /// Where the edge meets the plane: the same number for both triangles of the edge.
  SectionEnd cut(int from, int to, int k) const {
    if (from > to) std::swap(from, to);
    const auto p = points_.row(from), q = points_.row(to);
    const double t = (k - p[2]) / (q[2] - p[2]);
    return {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
  }

  /// Half-open: a vertex in the plane counts as below it, so that a triangle has either no
  /// edge that crosses or one upward and one downward.
  template <class Visit>
  void visit_section(const Eigen::Ref<const Eigen::RowVector3i>& triangle, int k,
                     const Visit& visit) const {
    SectionEnd up{}, down{};
    bool crosses = false;
    for (int at = 0; at < 3; ++at) {
      const int from = triangle[at], to = triangle[(at + 1) % 3];
      const bool from_above = points_(from, 2) > k, to_above = points_(to, 2) > k;
      if (from_above == to_above) continue;
      crosses = true;
      (to_above ? up : down) = cut(from, to, k);
    }
    if (!crosses) return;
    const int sign = up.j < down.j ? 1 : -1;
    const int first = first_index(std::min(up.j, down.j), size_[1]);
    const int last = first_index(std::max(up.j, down.j), size_[1]);
    for (int j = first; j < last; ++j)
      visit(up.i + (j - up.j) / (down.j - up.j) * (down.i - up.i), j, k, sign);
  }

  const Points<3>& points_;
  std::array<int, 3> size_;
};

}  // namespace surf::mesh
