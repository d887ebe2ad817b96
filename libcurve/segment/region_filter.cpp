#include "libcurve/segment/region_filter.h"

#include <fmt/format.h>

#include <algorithm>

#include "libcurve/mesh/hierarchy.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

/// Whether a component winds round the point.
bool winds_round(const Segments& curves, const CurveHierarchy& hierarchy, int component,
                 const Vector<2>& point) {
  bool inside = false;
  for (Eigen::Index t = 0; t < curves.elements.rows(); ++t) {
    if (hierarchy.of_element[t] != component) continue;
    const Vector<2> a = curves.points.row(curves.elements(t, 0)),
                    b = curves.points.row(curves.elements(t, 1));
    if ((a[1] > point[1]) == (b[1] > point[1])) continue;
    if (a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > point[0]) inside = !inside;
  }
  return inside;
}

constexpr const char* kSmall = "small region";
constexpr const char* kNotLargest = "region besides the largest";
constexpr const char* kNotSeeded = "region without a seed";

/// Why each region goes; null = it stays.
std::vector<const char*> reasons(const Segments& curves, const CurveHierarchy& hierarchy,
                                 const std::vector<Region>& all, const RegionFilter& filter) {
  std::vector<const char*> out(all.size(), nullptr);
  for (std::size_t n = 0; n < all.size(); ++n)
    if (!(all[n].area_mm2 >= filter.min_area_mm2)) out[n] = kSmall;
  if (filter.keep == mesh::Keep::kLargest && !all.empty()) {
    const auto largest = std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.area_mm2 < b.area_mm2;
    });
    for (std::size_t n = 0; n < all.size(); ++n)
      if (!out[n] && std::ptrdiff_t(n) != largest - all.begin()) out[n] = kNotLargest;
  }
  if (filter.keep == mesh::Keep::kSeeded)
    for (std::size_t n = 0; n < all.size(); ++n) {
      const bool has_seed =
          std::any_of(filter.seeds_mm.begin(), filter.seeds_mm.end(), [&](const Vector<2>& seed) {
            const auto winds = [&](int c) { return winds_round(curves, hierarchy, c, seed); };
            return winds(all[n].outer) &&
                   std::none_of(all[n].holes.begin(), all[n].holes.end(), winds);
          });
      if (!out[n] && !has_seed) out[n] = kNotSeeded;
    }
  return out;
}

/// Notes each component that does not stay by itself.
void note_components(const CurveHierarchy& hierarchy, const std::vector<char>& stays,
                     const char* of_hole, const char* of_region,
                     std::vector<RemovedRegion>& removed) {
  for (std::size_t n = 0; n < stays.size(); ++n)
    if (const Component& part = hierarchy.components[n]; !stays[n])
      removed.push_back({part.area_mm2 < 0 ? of_hole : of_region, 1, part.area_mm2, part.centre});
}

Segments without_holes(const Segments& curves, std::vector<RemovedRegion>& removed) {
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<char> stays;
  for (const Component& component : hierarchy.components) stays.push_back(component.depth == 0);
  note_components(hierarchy, stays, "filled hole", "region in a filled hole", removed);
  return kept(curves, hierarchy, stays);
}

}  // namespace

std::string RegionFilter::error() const {
  if (!(min_area_mm2 >= 0))
    return fmt::format("RegionFilter::min_area_mm2 = {} violates >= 0", min_area_mm2);
  if (keep == mesh::Keep::kSeeded && seeds_mm.empty())
    return "RegionFilter::keep is kSeeded and there is no seed";
  return {};
}

FilteredCurves filtered(const Segments& curves, const RegionFilter& filter) {
  if (const std::string error = filter.error(); !error.empty()) throw UsageError(error);
  FilteredCurves out;
  const Segments filled = filter.fill_holes ? without_holes(curves, out.removed) : curves;
  const CurveHierarchy hierarchy = curve_hierarchy(filled);
  const std::vector<Region> all = regions(hierarchy);
  const std::vector<const char*> why = reasons(filled, hierarchy, all, filter);
  std::vector<char> stays(hierarchy.components.size(), 0), is_of_region(stays);
  for (std::size_t n = 0; n < all.size(); ++n) {
    stays[all[n].outer] = !why[n];
    is_of_region[all[n].outer] = 1;
    for (const int hole : all[n].holes) stays[hole] = !why[n], is_of_region[hole] = 1;
    if (why[n])
      out.removed.push_back({why[n], 1 + int(all[n].holes.size()), all[n].area_mm2,
                             hierarchy.components[all[n].outer].centre});
  }
  note_components(hierarchy, is_of_region, "phantom", "phantom", out.removed);
  out.curves = out.removed.empty() ? curves : kept(filled, hierarchy, stays);
  return out;
}

}  // namespace surf::curve
