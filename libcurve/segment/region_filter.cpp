#include "libcurve/segment/region_filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

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

/// Regions that stay, by number.
std::vector<char> kept_regions(const Segments& curves, const CurveHierarchy& hierarchy,
                               const std::vector<Region>& all, const RegionFilter& filter) {
  std::vector<char> keep(all.size());
  for (std::size_t n = 0; n < all.size(); ++n) keep[n] = all[n].area_mm2 >= filter.min_area_mm2;
  if (filter.keep == mesh::Keep::kLargest && !all.empty()) {
    const auto largest = std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.area_mm2 < b.area_mm2;
    });
    for (std::size_t n = 0; n < all.size(); ++n)
      keep[n] &= std::ptrdiff_t(n) == largest - all.begin();
  }
  if (filter.keep == mesh::Keep::kSeeded)
    for (std::size_t n = 0; n < all.size(); ++n)
      keep[n] &=
          std::any_of(filter.seeds_mm.begin(), filter.seeds_mm.end(), [&](const Vector<2>& seed) {
            const auto winds = [&](int c) { return winds_round(curves, hierarchy, c, seed); };
            return winds(all[n].outer) &&
                   std::none_of(all[n].holes.begin(), all[n].holes.end(), winds);
          });
  return keep;
}

Segments without_holes(const Segments& curves) {
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<char> keep;
  for (const Component& component : hierarchy.components) keep.push_back(component.depth == 0);
  return kept(curves, hierarchy, keep);
}

}  // namespace

std::string RegionFilter::error() const {
  if (!(min_area_mm2 >= 0))
    return fmt::format("RegionFilter::min_area_mm2 = {} violates >= 0", min_area_mm2);
  if (keep == mesh::Keep::kSeeded && seeds_mm.empty())
    return "RegionFilter::keep is kSeeded and there is no seed";
  return {};
}

Segments filtered(const Segments& curves, const RegionFilter& filter, int& n_removed) {
  if (const std::string error = filter.error(); !error.empty()) throw UsageError(error);
  const auto n_before = curve_hierarchy(curves).components.size();
  const Segments filled = filter.fill_holes ? without_holes(curves) : curves;
  const CurveHierarchy hierarchy = curve_hierarchy(filled);
  const std::vector<Region> all = regions(hierarchy);
  const std::vector<char> keep_region = kept_regions(filled, hierarchy, all, filter);
  std::vector<char> keep(hierarchy.components.size(), 0);
  for (std::size_t n = 0; n < all.size(); ++n) {
    if (!keep_region[n]) continue;
    keep[all[n].outer] = 1;
    for (const int hole : all[n].holes) keep[hole] = 1;
  }
  n_removed = int(n_before) - std::accumulate(keep.begin(), keep.end(), 0);
  return n_removed == 0 ? curves : kept(filled, hierarchy, keep);
}

}  // namespace surf::curve
