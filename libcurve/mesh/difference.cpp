#include "libcurve/mesh/difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/surgery.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/mesh/point_obstacles.h"

namespace surf::curve {
namespace {

constexpr std::array kGaps = {1.0, 0.8, 1.25, 0.6, 1.5, 0.5};  // tries: shares of the wanted gap

double enclosed(const Segments& curves) {
  return curves.elements.rows() == 0 ? 0
                                     : fem::Geometry<2>(curves.points, curves.elements).enclosed();
}

bool has_point_inside(const Segments& points_of, const Segments& region) {
  const CurveHierarchy hierarchy = curve_hierarchy(points_of);
  Points<2> one_each(Eigen::Index(hierarchy.components.size()), 2);
  for (std::size_t n = 0; n < hierarchy.components.size(); ++n)
    one_each.row(Eigen::Index(n)) =
        points_of.points.row(points_of.elements(hierarchy.components[n].first_element, 0));
  const std::vector<char> is_inside = mesh::are_inside<2>(region, one_each);
  return std::find(is_inside.begin(), is_inside.end(), 1) != is_inside.end();
}

/// Phantoms go, and pieces at the cut that are too small or too thin; those that were there before
/// stay.
Segments without_crumbs(const Segments& before, const Segments& after,
                        const mesh::PartOptions<2>& options, mesh::Parted<2>& out) {
  std::set<std::array<double, 2>> known;
  for (const auto& x : before.points.rowwise()) known.insert({x[0], x[1]});
  const CurveHierarchy hierarchy = curve_hierarchy(after);
  std::vector<char> is_cut(hierarchy.components.size()), stays(hierarchy.components.size());
  for (Eigen::Index e = 0; e < after.elements.rows(); ++e) {
    const auto x = after.points.row(after.elements(e, 0));
    if (!known.contains({x[0], x[1]})) is_cut[hierarchy.of_element[e]] = 1;
  }
  for (const Region& region : regions(hierarchy)) {
    const double thickness = 2 * region.area_mm2 / region.length_mm;
    if (is_cut[region.outer] &&
        (hierarchy.components[region.outer].area_mm2 < options.min_content ||
         thickness < options.min_thickness_mm)) {
      ++out.n_crumbs;
      out.crumbs += region.area_mm2;
      continue;
    }
    stays[region.outer] = 1;
    for (const int hole : region.holes) stays[hole] = 1;
  }
  return kept(after, hierarchy, stays);
}

std::optional<mesh::Parted<2>> attempt(const Segments& curves, const Segments& other, double gap_mm,
                                       const mesh::PartOptions<2>& options) {
  CurveMesh both(joined({curves, flipped(moved_along_normals(other, gap_mm))}));
  if (!operate(both, {}).is_resolved) return std::nullopt;
  mesh::Parted<2> out;
  out.has_changed = true;
  if (both.size() > 0) out.shape = without_crumbs(curves, both.segments(), options, out);
  if (out.shape.elements.rows() > 0) {
    if (options.rounded) out.shape = options.rounded(out.shape);
    if (!verify(out.shape).passed() || do_overlap(out.shape, other)) return std::nullopt;
  }
  out.removed = enclosed(curves) - enclosed(out.shape);
  return out;
}

}  // namespace

Segments moved_along_normals(const Segments& curves, double distance_mm) {
  Points<2> normals = Points<2>::Zero(curves.points.rows(), 2);
  for (const auto& e : curves.elements.rowwise()) {
    const Vector<2> along = curves.points.row(e[1]) - curves.points.row(e[0]);
    if (!(along.norm() > 0)) continue;
    const Vector<2> normal = Vector<2>(along[1], -along[0]).normalized();
    for (const int node : e) normals.row(node) += normal;
  }
  Segments out = curves;
  for (Eigen::Index i = 0; i < normals.rows(); ++i)
    if (normals.row(i).norm() > 0) out.points.row(i) += distance_mm * normals.row(i).normalized();
  return out;
}

bool do_overlap(const Segments& first, const Segments& second) {
  const Segments both = joined({first, second});
  const auto n_first = int(first.elements.rows());
  for (const auto& [a, b] : intersections(both.points, both.elements))
    if ((a < n_first) != (b < n_first)) return true;
  return has_point_inside(first, second) || has_point_inside(second, first);
}

mesh::Parted<2> parted(const Segments& curves, const Segments& other,
                       const mesh::PartOptions<2>& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  mesh::Parted<2> same;
  same.shape = curves;
  if (curves.elements.rows() == 0 || other.elements.rows() == 0 || !do_overlap(curves, other))
    return same;
  for (const double share : kGaps)
    if (auto out = attempt(curves, other, share * options.gap_mm, options)) return *out;
  throw InvalidMesh("no cut along its wall passes the final check");
}

}  // namespace surf::curve
