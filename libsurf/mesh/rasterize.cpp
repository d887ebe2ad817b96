#include "libsurf/mesh/rasterize.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace surf::mesh {
namespace {

/// A point of a triangle's section with the plane of constant k.
struct SectionEnd {
  double i, j;
};

/// Smallest integer >= x, within [0, n].
int first_index(double x, int n) {
  if (!(x > 0)) return 0;
  return x >= n ? n : static_cast<int>(std::ceil(x));
}

/// Change of the winding number where rays along +i meet the surface, for grid points
/// (i, j, k) at (k * size_j + j) * (size_i + 1) + i.
class Crossings {
 public:
  Crossings(const Points<3>& points_index, const std::array<int, 3>& size)
      : points_(points_index),
        size_(size),
        changes_(std::size_t(size[0] + 1) * size[1] * size[2]) {}

  void add_triangle(int a, int b, int c) {
    const double k[3] = {points_(a, 2), points_(b, 2), points_(c, 2)};
    const int first = first_index(std::min({k[0], k[1], k[2]}), size_[2]);
    const int last = first_index(std::max({k[0], k[1], k[2]}), size_[2]);
    for (int plane = first; plane < last; ++plane) add_section(a, b, c, plane);
  }

  std::vector<std::uint8_t> inside() const {
    std::vector<std::uint8_t> result;
    result.reserve(std::size_t(size_[0]) * size_[1] * size_[2]);
    for (std::size_t row = 0; row < std::size_t(size_[1]) * size_[2]; ++row) {
      int winding = 0;
      for (int i = 0; i < size_[0]; ++i) {
        winding += changes_[row * (size_[0] + 1) + i];
        result.push_back(winding != 0);
      }
    }
    return result;
  }

 private:
  /// Where the edge meets the plane: the same number for both triangles of the edge.
  SectionEnd cut(int from, int to, int k) const {
    if (from > to) std::swap(from, to);
    const auto p = points_.row(from), q = points_.row(to);
    const double t = (k - p[2]) / (q[2] - p[2]);
    return {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
  }

  /// Half-open: a vertex in the plane counts as below it, so that a triangle has either no
  /// edge that crosses or one upward and one downward.
  void add_section(int a, int b, int c, int k) {
    const int corner[3] = {a, b, c};
    SectionEnd up{}, down{};
    bool crosses = false;
    for (int at = 0; at < 3; ++at) {
      const int from = corner[at], to = corner[(at + 1) % 3];
      const bool from_above = points_(from, 2) > k, to_above = points_(to, 2) > k;
      if (from_above == to_above) continue;
      crosses = true;
      (to_above ? up : down) = cut(from, to, k);
    }
    if (crosses) add_segment(up, down, k);
  }

  void add_segment(const SectionEnd& from, const SectionEnd& to, int k) {
    const int sign = from.j < to.j ? 1 : -1;
    const int first = first_index(std::min(from.j, to.j), size_[1]);
    const int last = first_index(std::max(from.j, to.j), size_[1]);
    for (int j = first; j < last; ++j) {
      const double t = (j - from.j) / (to.j - from.j);
      const int i = first_index(from.i + t * (to.i - from.i), size_[0]);
      changes_[(std::size_t(k) * size_[1] + j) * (size_[0] + 1) + i] +=
          static_cast<std::int16_t>(sign);
    }
  }

  const Points<3>& points_;
  std::array<int, 3> size_;
  std::vector<std::int16_t> changes_;
};

}  // namespace

std::vector<std::uint8_t> rasterize(const Triangles& surface, const std::array<int, 3>& size,
                                    const Eigen::Affine3d& index_to_world) {
  const Eigen::Affine3d world_to_index = index_to_world.inverse();
  const Points<3> points = (surface.points * world_to_index.linear().transpose()).rowwise() +
                           world_to_index.translation().transpose();
  Crossings crossings(points, size);
  for (const auto element : surface.elements.rowwise())
    crossings.add_triangle(element[0], element[1], element[2]);
  return crossings.inside();
}

}  // namespace surf::mesh
