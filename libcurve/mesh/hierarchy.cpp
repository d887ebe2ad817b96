#include "libcurve/mesh/hierarchy.h"

#include <CGAL/Exact_rational.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "libcurve/mesh/curve_mesh.h"
#include "libcurve/mesh/detail/winding_rays.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

/// Sign of the exact area.
bool is_outward_exactly(const Segments& curves, const std::vector<int>& of_element, int component) {
  using Exact = CGAL::Exact_rational;
  Exact twice_area = 0;
  for (Eigen::Index e = 0; e < curves.elements.rows(); ++e) {
    if (of_element[e] != component) continue;
    const auto a = curves.points.row(curves.elements(e, 0)),
               b = curves.points.row(curves.elements(e, 1));
    twice_area += Exact(a[0]) * Exact(b[1]) - Exact(a[1]) * Exact(b[0]);
  }
  return twice_area > 0;
}

/// Algorithm 12, without the order of the elements.
CurveHierarchy measured_components(const Segments& curves) {
  const Eigen::Index n = curves.elements.rows();
  CurveHierarchy out;
  out.of_element.assign(n, -1);
  CurveMesh checked(curves);  // throws if a curve is open
  std::vector<int> starting(curves.points.rows(), -1);
  for (Eigen::Index e = 0; e < n; ++e) starting[curves.elements(e, 0)] = static_cast<int>(e);
  for (Eigen::Index first = 0; first < n; ++first) {
    if (out.of_element[first] >= 0) continue;
    Component part;
    part.first_element = static_cast<int>(first);
    const Vector<2> origin = curves.points.row(curves.elements(first, 0));
    double extent = 0;
    for (int e = part.first_element; out.of_element[e] < 0; e = starting[curves.elements(e, 1)]) {
      out.of_element[e] = static_cast<int>(out.components.size());
      const Vector<2> a = curves.points.row(curves.elements(e, 0)).transpose() - origin,
                      b = curves.points.row(curves.elements(e, 1)).transpose() - origin;
      const double length = (b - a).norm();
      ++part.n_elements;
      part.area_mm2 += cross(a, b) / 2;
      part.length_mm += length;
      part.centre += length * (a + b) / 2;
      extent = std::max(extent, a.norm());
    }
    part.centre = part.length_mm > 0 ? Vector<2>(origin + part.centre / part.length_mm) : origin;
    constexpr double kRounding = 8 * 2.3e-16;
    const double error = kRounding * part.n_elements * (extent + origin.norm()) * extent;
    part.is_outward = part.area_mm2 > 0;
    out.components.push_back(part);
    if (!(std::abs(part.area_mm2) > error))
      out.components.back().is_outward =
          is_outward_exactly(curves, out.of_element, int(out.components.size()) - 1);
  }
  return out;
}

int longest_element(const Segments& curves, const std::vector<int>& starting, int first) {
  int longest = first;
  double length = -1;
  int e = first;
  do {
    const double l =
        (curves.points.row(curves.elements(e, 1)) - curves.points.row(curves.elements(e, 0)))
            .squaredNorm();
    if (l > length) longest = e, length = l;
    e = starting[curves.elements(e, 1)];
  } while (e != first);
  return longest;
}

/// For each component those that enclose it, and its winding number outside.
void nest(const Segments& curves, CurveHierarchy& hierarchy) {
  auto& parts = hierarchy.components;
  std::vector<int> starting(curves.points.rows(), -1);
  for (Eigen::Index e = 0; e < curves.elements.rows(); ++e)
    starting[curves.elements(e, 0)] = static_cast<int>(e);
  WindingRays rays(curves.points, curves.elements);
  std::vector<std::vector<int>> enclosing(parts.size());
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const int e = longest_element(curves, starting, parts[n].first_element);
    std::map<int, int> winding;
    const ExactPoint a = exact_point(curves.points, curves.elements(e, 0)),
                     b = exact_point(curves.points, curves.elements(e, 1));
    rays.for_each_crossed(a, b, is_flat(a, b), [&](int other, int sign, bool is_on) {
      if (!is_on) winding[hierarchy.of_element[other]] += sign;
    });
    parts[n].winding_before = parts[n].is_outward ? 0 : -1;
    for (const auto& [other, sum] : winding) {
      if (sum == 0 || other == int(n)) continue;
      enclosing[n].push_back(other);
      parts[n].winding_before += parts[other].is_outward ? 1 : -1;
    }
    parts[n].depth = static_cast<int>(enclosing[n].size());
  }
  for (std::size_t n = 0; n < parts.size(); ++n)
    for (const int outer : enclosing[n])
      if (parts[outer].depth < parts[n].depth &&
          (!parts[n].parent || parts[outer].depth > parts[*parts[n].parent].depth))
        parts[n].parent = outer;
}

}  // namespace

CurveHierarchy curve_hierarchy(const Segments& curves) {
  CurveHierarchy out = measured_components(curves);
  nest(curves, out);
  return out;
}

std::vector<Region> regions(const CurveHierarchy& hierarchy) {
  const auto& parts = hierarchy.components;
  std::vector<int> region_of(parts.size(), -1);
  std::vector<Region> out;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (!parts[n].is_real() || !parts[n].is_outward) continue;
    region_of[n] = static_cast<int>(out.size());
    out.push_back({static_cast<int>(n), {}, parts[n].area_mm2, parts[n].length_mm});
  }
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (!parts[n].is_real() || parts[n].is_outward) continue;
    // Phantoms may lie between a hole and the component that it is a hole of.
    std::optional<int> outer = parts[n].parent;
    while (outer && !(parts[*outer].is_real() && parts[*outer].is_outward))
      outer = parts[*outer].parent;
    if (!outer) continue;
    Region& region = out[region_of[*outer]];
    region.holes.push_back(static_cast<int>(n));
    region.area_mm2 += parts[n].area_mm2;
    region.length_mm += parts[n].length_mm;
  }
  return out;
}

Segments kept(const Segments& curves, const CurveHierarchy& hierarchy,
              const std::vector<char>& keep) {
  std::vector<int> number(curves.points.rows(), -1), rows, points;
  for (Eigen::Index e = 0; e < curves.elements.rows(); ++e) {
    if (!keep[hierarchy.of_element[e]]) continue;
    rows.push_back(static_cast<int>(e));
    number[curves.elements(e, 0)] = 0;
  }
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] < 0) continue;
    number[i] = static_cast<int>(points.size());
    points.push_back(static_cast<int>(i));
  }
  Segments out{curves.points(points, Eigen::all), curves.elements(rows, Eigen::all)};
  for (int& node : out.elements.reshaped()) node = number[node];
  return out;
}

Segments in_file_order(const Segments& curves) {
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<int> order;
  std::vector<char> is_of_region(hierarchy.components.size(), 0);
  for (const Region& region : regions(hierarchy)) {
    order.push_back(region.outer);
    order.insert(order.end(), region.holes.begin(), region.holes.end());
  }
  for (const int component : order) is_of_region[component] = 1;
  for (int n = 0; n < int(is_of_region.size()); ++n)
    if (!is_of_region[n]) order.push_back(n);
  std::vector<int> next(std::size_t(curves.points.rows()), -1), nodes;
  for (const auto element : curves.elements.rowwise()) next[element[0]] = element[1];
  Elements<2> elements(curves.elements.rows(), 2);
  for (const int component : order) {
    const int first = int(nodes.size()), n = hierarchy.components[component].n_elements;
    int node = curves.elements(hierarchy.components[component].first_element, 0);
    for (int i = 0; i < n; ++i, node = next[node]) {
      nodes.push_back(node);
      elements.row(first + i) << first + i, first + (i + 1) % n;
    }
  }
  return {curves.points(nodes, Eigen::all), elements};
}

}  // namespace surf::curve
