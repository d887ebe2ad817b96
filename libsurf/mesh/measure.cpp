#include "libsurf/mesh/measure.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

#include "libsurf/base/products.h"
#include "libsurf/mesh/detail/component_measures.h"

namespace surf::mesh {
namespace {

struct Corners {
  Vector<3> a, b, c;
  Vector<3> doubled_area() const { return (b - a).cross(c - a); }
};

Corners corners(const Triangles& surface, Eigen::Index row) {
  const auto element = surface.elements.row(row);
  return {surface.points.row(element[0]), surface.points.row(element[1]),
          surface.points.row(element[2])};
}

/// A point near the surface: sums relative to it do not cancel far from the world's origin.
Vector<3> base_point(const Triangles& surface) {
  if (surface.elements.rows() == 0) return Vector<3>::Zero();
  return surface.points.row(surface.elements(0, 0));
}

double angle_deg(const Vector<3>& u, const Vector<3>& v) {
  return angle_between(u, v) * 180.0 / std::numbers::pi;
}

}  // namespace

double area_mm2(const Triangles& surface) {
  double doubled = 0;
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row)
    doubled += corners(surface, row).doubled_area().norm();
  return doubled / 2;
}

double volume_mm3(const Triangles& surface) {
  const Vector<3> base = base_point(surface);
  double sixfold = 0;
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row) {
    const Corners at = corners(surface, row);
    sixfold += triple(at.a - base, at.b - base, at.c - base);
  }
  return sixfold / 6;
}

Vector<3> centroid(const Triangles& surface) {
  const Vector<3> base = base_point(surface);
  Vector<3> of_volume = Vector<3>::Zero(), of_area = Vector<3>::Zero(), opening = of_area;
  double sixfold = 0, doubled = 0;
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row) {
    const auto [a, b, c] = corners(surface, row);
    const Vector<3> sum = a + b + c - 3 * base;
    const double volume = triple(a - base, b - base, c - base);
    const Vector<3> normal = (b - a).cross(c - a);
    const double area = normal.norm();
    sixfold += volume;
    doubled += area;
    opening += normal;              // of a closed surface nothing
    of_volume += volume * sum / 4;  // the tetrahedron's fourth corner is the base
    of_area += area * sum / 3;
  }
  // What an open surface spans with the base is a matter of the base; holes of a few triangles do
  // not matter.
  constexpr double kMostOpen = 0.01;  // of the area
  if (sixfold != 0 && opening.norm() <= kMostOpen * doubled) return base + of_volume / sixfold;
  return doubled > 0 ? Vector<3>(base + of_area / doubled) : base;
}

std::vector<ComponentMeasures> measure_components(const Triangles& surface) {
  const std::vector<EdgeUse> uses = edge_uses(surface.elements);
  return measure_components(surface, uses, components(uses, surface.elements.rows()));
}

std::vector<ComponentMeasures> measure_components(const Triangles& surface,
                                                  const std::vector<EdgeUse>& uses,
                                                  const Components& parts) {
  std::vector<ComponentMeasures> result(parts.n);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    ComponentMeasures& part = result[parts.of_element[edge[0].element]];
    ++part.n_edges;
    part.n_border_edges += edge.size() == 1;
  });
  std::vector<Vector<3>> bases(parts.n);  // its own, so that small parts lose no digits
  std::vector<int> last_part(surface.points.rows(), -1);  // of each vertex: parts may share one
  for (const int row : parts.elements_by_component()) {
    const int number = parts.of_element[row];
    ComponentMeasures& part = result[number];
    const Corners at = corners(surface, row);
    if (part.n_triangles++ == 0) bases[number] = at.a;
    const Vector<3>& base = bases[number];
    const double area = at.doubled_area().norm() / 2;
    part.area_mm2 += area;
    part.area_centroid_mm += area / 3 * (at.a + at.b + at.c - 3 * base);
    part.volume_mm3 += triple(at.a - base, at.b - base, at.c - base) / 6;
    for (const int vertex : surface.elements.row(row))
      if (std::exchange(last_part[vertex], number) != number) ++part.n_vertices;
  }
  for (int number = 0; number < parts.n; ++number) {
    ComponentMeasures& part = result[number];
    if (part.area_mm2 > 0) part.area_centroid_mm /= part.area_mm2;
    part.area_centroid_mm += bases[number];
  }
  return result;
}

Eigen::Vector3d angles_deg(const Vector<3>& a, const Vector<3>& b, const Vector<3>& c) {
  return {angle_deg(b - a, c - a), angle_deg(c - b, a - b), angle_deg(a - c, b - c)};
}

Quality quality(const Triangles& surface) {
  Quality result;
  const Eigen::Index n = surface.elements.rows();
  if (n == 0) return result;
  result.min_angle_deg = 180;
  result.min_edge_mm = std::numeric_limits<double>::max();
  Eigen::Index n_good = 0;
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto [a, b, c] = corners(surface, row);
    const Eigen::Vector3d angles = angles_deg(a, b, c);
    result.min_angle_deg = std::min(result.min_angle_deg, angles.minCoeff());
    result.max_angle_deg = std::max(result.max_angle_deg, angles.maxCoeff());
    n_good += angles.minCoeff() >= 25.0;
  }
  result.share_above_25_deg = double(n_good) / double(n);
  std::size_t n_edges = 0;
  for_each_edge(edge_uses(surface.elements), [&](std::span<const EdgeUse> edge) {
    const double length =
        (surface.points.row(edge[0].low) - surface.points.row(edge[0].high)).norm();
    result.min_edge_mm = std::min(result.min_edge_mm, length);
    result.max_edge_mm = std::max(result.max_edge_mm, length);
    result.mean_edge_mm += length;
    ++n_edges;
  });
  result.mean_edge_mm /= double(n_edges);
  return result;
}

}  // namespace surf::mesh
