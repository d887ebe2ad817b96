#include "libsurf/mesh/detail/winding_grid.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libsurf/mesh/detail/grid_crossings.h"

namespace surf::mesh {
namespace {

struct Crossing {
  std::uint32_t line;
  int sign;
  double place;

  bool operator<(const Crossing& other) const {
    if (line != other.line) return line < other.line;
    return place != other.place ? place < other.place : sign > other.sign;
  }
};

/// Coordinates in the order that makes an axis the first one, cyclically.
Points<3> turned(const Points<3>& points, int axis) {
  Points<3> out(points.rows(), 3);
  for (int i = 0; i < 3; ++i) out.col(i) = points.col((axis + i) % 3);
  return out;
}

std::array<int, 3> turned(const std::array<int, 3>& size, int axis) {
  return {size[axis], size[(axis + 1) % 3], size[(axis + 2) % 3]};
}

std::vector<Crossing> crossings_along(int axis, const Points<3>& points_index,
                                      const Elements<3>& elements, const std::array<int, 3>& size) {
  const Points<3> points = turned(points_index, axis);
  const std::array<int, 3> lines = turned(size, axis);
  const GridCrossings crossings(points, lines);
  std::vector<Crossing> found;
  for (const auto element : elements.rowwise())
    crossings.visit_triangle(element, [&](double i, int j, int k, int sign) {
      found.push_back({static_cast<std::uint32_t>(std::size_t(k) * lines[1] + j), sign, i});
    });
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

WindingGrid::WindingGrid(const Points<3>& points, const Elements<3>& elements,
                         const CubicGrid& grid)
    : grid_(grid), inside_(grid.n_nodes(), 0) {
  Points<3> index = (points.rowwise() - grid.origin.transpose()) / grid.spacing;
  tbb::parallel_for(0, 3, [&](int axis) {
    const std::array<int, 3> size = turned(grid.size, axis);
    const std::size_t n_lines = std::size_t(size[1]) * size[2];
    Lines& lines = lines_[axis];
    lines.first.assign(n_lines + 1, 0);
    const std::vector<Crossing> all = crossings_along(axis, index, elements, grid.size);
    std::size_t at = 0;
    for (std::size_t line = 0; line < n_lines; ++line) {
      lines.first[line] = static_cast<std::uint32_t>(lines.places.size());
      int winding = 0;
      for (; at < all.size() && all[at].line == line; ++at) {
        const bool was_inside = winding >= 1;
        winding += all[at].sign;
        if (was_inside != (winding >= 1)) lines.places.push_back(all[at].place);
      }
      if (axis > 0) continue;
      bool is_inside = false;
      std::size_t next = lines.first[line];
      for (int i = 0; i < size[0]; ++i) {
        for (; next < lines.places.size() && lines.places[next] <= i; ++next)
          is_inside = !is_inside;
        inside_[line * size[0] + i] = is_inside;
      }
    }
    lines.first[n_lines] = static_cast<std::uint32_t>(lines.places.size());
  });
}

std::size_t WindingGrid::line(int axis, const std::array<int, 3>& node) const {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  return std::size_t(node[k]) * grid_.size[j] + node[j];
}

double WindingGrid::crossing(int axis, const std::array<int, 3>& node) const {
  const Lines& lines = lines_[axis];
  const std::size_t at = line(axis, node);
  const auto begin = lines.places.begin() + lines.first[at];
  const auto end = lines.places.begin() + lines.first[at + 1];
  const auto first = std::upper_bound(begin, end, double(node[axis]));
  const auto last = std::upper_bound(first, end, double(node[axis] + 1));
  if ((last - first) % 2 == 0) return 0;
  return std::clamp(first[(last - first) / 2] - node[axis], 1e-3, 1 - 1e-3);
}

SidesOfTriangle winding_beside(const Points<3>& points, const Elements<3>& elements, int triangle) {
  const Vector<3> a = points.row(elements(triangle, 0)), b = points.row(elements(triangle, 1)),
                  c = points.row(elements(triangle, 2));
  const Vector<3> normal = (b - a).cross(c - a);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const Vector<3> centroid = (a + b + c) / 3;
  const Points<3> index = turned(points.rowwise() - centroid.transpose(), axis);
  const GridCrossings crossings(index, {1, 1, 1});
  double own = std::numeric_limits<double>::quiet_NaN();
  crossings.visit_triangle(elements.row(triangle), [&](double i, int, int, int) { own = i; });
  int before = 0, after = 0;  // winding numbers on both sides of the triangle along the axis
  for (int t = 0; t < elements.rows(); ++t)
    crossings.visit_triangle(elements.row(t), [&](double i, int, int, int sign) {
      if (t != triangle && i < own) before += sign;
      if (t != triangle && i > own) after -= sign;
    });
  // On a closed surface before + (own sign) = after; rounding at the own place is settled so.
  const bool is_entered = normal[axis] < 0;
  return is_entered ? SidesOfTriangle{after, after - 1} : SidesOfTriangle{before, before - 1};
}

}  // namespace surf::mesh
