#include "libsurf/mesh/hierarchy.h"

#include <CGAL/Exact_rational.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/detail/component_measures.h"
#include "libsurf/mesh/detail/edge_uses.h"
#include "libsurf/mesh/detail/ray_crossings.h"

namespace surf::mesh {
namespace {

using Exact = CGAL::Exact_rational;

/// Six times the volume of the tetrahedron with a fourth corner at the origin.
Exact sixfold_volume(const Triangles& surface, Eigen::Index row) {
  std::array<std::array<Exact, 3>, 3> p;
  for (int corner = 0; corner < 3; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      p[corner][axis] = surface.points(surface.elements(row, corner), axis);
  const auto& [a, b, c] = p;
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// Whether the normals of each component point outward: the sign of its volume, summed exactly
/// where rounding might decide it.
std::vector<bool> are_outward(const Triangles& surface, const Components& parts,
                              const std::vector<ComponentMeasures>& measures) {
  std::vector<Eigen::AlignedBox3d> boxes(parts.n);
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row)
    for (const int vertex : surface.elements.row(row))
      boxes[parts.of_element[row]].extend(Vector<3>(surface.points.row(vertex)));
  std::map<int, Exact> exact;
  std::vector<bool> result(parts.n);
  for (int part = 0; part < parts.n; ++part) {
    // Each term is a product of three differences, each at most the diagonal.
    constexpr double kRounding = 16 * 2.3e-16;
    const double error =
        kRounding * measures[part].n_triangles * std::pow(boxes[part].diagonal().norm(), 3);
    result[part] = measures[part].volume_mm3 > 0;
    if (!(std::abs(measures[part].volume_mm3) > error)) exact[part] = 0;
  }
  if (exact.empty()) return result;
  for (Eigen::Index row = 0; row < surface.elements.rows(); ++row)
    if (const auto at = exact.find(parts.of_element[row]); at != exact.end())
      at->second += sixfold_volume(surface, row);
  for (const auto& [part, volume] : exact) result[part] = volume > 0;
  return result;
}

/// For each shell those that enclose it, ascending: the ray leaves them more often than it enters,
/// or less if they are inverted.
std::vector<std::vector<int>> enclosing_shells(const Triangles& surface, const Components& parts) {
  const Points<3> origins = surface.points(extreme_vertices(surface, parts), Eigen::all);
  std::map<std::pair<int, int>, int> winding;
  for (const RayCrossing& crossing : ray_crossings(surface, origins))
    winding[{crossing.ray, parts.of_element[crossing.element]}] += crossing.sign;
  std::vector<std::vector<int>> result(parts.n);
  for (const auto& [pair, n] : winding)
    if (n != 0 && pair.first != pair.second) result[pair.first].push_back(pair.second);
  return result;
}

void nest(std::vector<Shell>& shells, const std::vector<std::vector<int>>& enclosing) {
  for (std::size_t n = 0; n < shells.size(); ++n)
    shells[n].depth = static_cast<int>(enclosing[n].size());
  for (std::size_t n = 0; n < shells.size(); ++n) {
    Shell& shell = shells[n];
    shell.winding_before = shell.is_outward ? 0 : -1;
    for (const int outer : enclosing[n]) {
      shell.winding_before += shells[outer].is_outward ? 1 : -1;
      if (shells[outer].depth < shell.depth &&  // else they intersect: no parent of a parent
          (!shell.parent || shells[outer].depth > shells[*shell.parent].depth))
        shell.parent = outer;
    }
  }
}

/// The innermost real shell round this one.
std::optional<int> real_parent(const std::vector<Shell>& shells, int shell) {
  std::optional<int> at = shells[shell].parent;
  while (at && !shells[*at].is_real()) at = shells[*at].parent;
  return at;
}

/// The triangles of the shells that stay.
Triangles extracted(const Triangles& surface, const std::vector<int>& shell_of_triangle,
                    const std::vector<bool>& stays) {
  std::vector<int> rows;
  std::vector<int> number(surface.points.rows(), -1);
  for (int row = 0; row < surface.elements.rows(); ++row) {
    if (!stays[shell_of_triangle[row]]) continue;
    rows.push_back(row);
    for (const int vertex : surface.elements.row(row)) number[vertex] = 0;
  }
  std::vector<int> vertices;
  for (int vertex = 0; vertex < surface.points.rows(); ++vertex)
    if (number[vertex] == 0) {
      number[vertex] = static_cast<int>(vertices.size());
      vertices.push_back(vertex);
    }
  Triangles result{surface.points(vertices, Eigen::all), surface.elements(rows, Eigen::all)};
  for (int& vertex : result.elements.reshaped()) vertex = number[vertex];
  return result;
}

/// Removes solids one rule after the other and keeps account.
class Filter {
 public:
  Filter(const Triangles& surface)
      : surface_(surface),
        hierarchy_(shell_hierarchy(surface)),
        solids_(solids(hierarchy_)),
        stays_(hierarchy_.shells.size(), true) {
    for (int n = 0; n < int(stays_.size()); ++n)
      if (!hierarchy_.shells[n].is_real()) remove_shell(n, Removal::Reason::kPhantom);
  }

  void fill_cavities() {
    for (Solid& solid : solids_) {
      for (const int cavity : solid.cavities) {
        remove_shell(cavity, Removal::Reason::kFilled);
        solid.volume_mm3 -= hierarchy_.shells[cavity].volume_mm3;
      }
      solid.cavities.clear();
    }
    remove_if(Removal::Reason::kSwallowed, [&](const Solid& solid) {
      return real_parent(hierarchy_.shells, solid.outer).has_value();
    });
  }

  void remove_small(double min_volume_mm3) {
    remove_if(Removal::Reason::kSmall,
              [&](const Solid& solid) { return solid.volume_mm3 < min_volume_mm3; });
  }

  void keep_largest() {
    const auto largest = std::max_element(
        solids_.begin(), solids_.end(),
        [](const Solid& a, const Solid& b) { return a.volume_mm3 < b.volume_mm3; });
    if (largest == solids_.end()) return;
    const int outer = largest->outer;
    remove_if(Removal::Reason::kNotLargest,
              [&](const Solid& solid) { return solid.outer != outer; });
  }

  void keep_seeded(const Points<3>& seeds) {
    std::map<std::pair<int, int>, int> winding;  // of a shell round a seed
    for (const RayCrossing& crossing : ray_crossings(surface_, seeds))
      winding[{hierarchy_.of_triangle[crossing.element], crossing.ray}] += crossing.sign;
    const auto contains = [&](const Solid& solid, int seed) {
      int n = winding[{solid.outer, seed}];
      for (const int cavity : solid.cavities) n += winding[{cavity, seed}];
      return n > 0;
    };
    remove_if(Removal::Reason::kNotSeeded, [&](const Solid& solid) {
      for (int seed = 0; seed < seeds.rows(); ++seed)
        if (contains(solid, seed)) return false;
      return true;
    });
  }

  FilteredSurface result() && {
    return {extracted(surface_, hierarchy_.of_triangle, stays_), std::move(removed_)};
  }

 private:
  void remove_shell(int n, Removal::Reason reason) {
    const Shell& shell = hierarchy_.shells[n];
    stays_[n] = false;
    removed_.push_back({reason, 1, shell.volume_mm3, shell.center_ras_mm});
  }

  template <class Rule>
  void remove_if(Removal::Reason reason, Rule rule) {
    std::vector<Solid> rest;
    for (Solid& solid : solids_) {
      if (!rule(solid)) {
        rest.push_back(std::move(solid));
        continue;
      }
      stays_[solid.outer] = false;
      for (const int cavity : solid.cavities) stays_[cavity] = false;
      removed_.push_back({reason, 1 + int(solid.cavities.size()), solid.volume_mm3,
                          hierarchy_.shells[solid.outer].center_ras_mm});
    }
    solids_ = std::move(rest);
  }

  const Triangles& surface_;
  ShellHierarchy hierarchy_;
  std::vector<Solid> solids_;
  std::vector<bool> stays_;
  std::vector<Removal> removed_;
};

}  // namespace

ShellHierarchy shell_hierarchy(const Triangles& surface) {
  const std::vector<EdgeUse> uses = edge_uses(surface.elements);
  Components parts = components(uses, surface.elements.rows());
  const std::vector<ComponentMeasures> measures = measure_components(surface, uses, parts);
  const std::vector<bool> outward = are_outward(surface, parts, measures);
  ShellHierarchy result;
  for (int part = 0; part < parts.n; ++part) {
    const ComponentMeasures& of = measures[part];
    Shell& shell = result.shells.emplace_back();
    shell.n_triangles = of.n_triangles;
    shell.volume_mm3 = of.volume_mm3;
    shell.area_mm2 = of.area_mm2;
    shell.center_ras_mm = of.area_centroid_mm;
    shell.genus = of.genus();
    shell.is_outward = outward[part];
  }
  nest(result.shells, enclosing_shells(surface, parts));
  result.of_triangle = std::move(parts.of_element);
  return result;
}

std::vector<Solid> solids(const ShellHierarchy& hierarchy) {
  const std::vector<Shell>& shells = hierarchy.shells;
  std::vector<Solid> result;
  std::map<int, int> solid_of_outer;
  for (int n = 0; n < int(shells.size()); ++n)
    if (shells[n].is_real() && shells[n].is_outward) {
      solid_of_outer[n] = static_cast<int>(result.size());
      result.push_back({n, {}, shells[n].volume_mm3, shells[n].area_mm2});
    }
  for (int n = 0; n < int(shells.size()); ++n) {
    if (!shells[n].is_real() || shells[n].is_outward) continue;
    const std::optional<int> outer = real_parent(shells, n);
    const auto at = outer ? solid_of_outer.find(*outer) : solid_of_outer.end();
    if (at == solid_of_outer.end()) continue;  // shells that intersect
    Solid& solid = result[at->second];
    solid.cavities.push_back(n);
    solid.volume_mm3 += shells[n].volume_mm3;
    solid.area_mm2 += shells[n].area_mm2;
  }
  return result;
}

std::string SolidFilter::error() const {
  if (!(std::isfinite(min_volume_mm3) && min_volume_mm3 >= 0))
    return fmt::format("SolidFilter::min_volume_mm3 = {} violates 0 <= volume < Inf",
                       min_volume_mm3);
  if (!seeds_ras_mm.allFinite()) return "SolidFilter::seeds_ras_mm are not finite";
  if (keep == Keep::kSeeded && seeds_ras_mm.rows() == 0)
    return "SolidFilter::keep = kSeeded needs seeds_ras_mm";
  return {};
}

std::string to_string(Removal::Reason reason, int n) {
  const bool is_one = n == 1;
  switch (reason) {
    case Removal::Reason::kPhantom:
      return is_one ? "phantom" : "phantoms";
    case Removal::Reason::kFilled:
      return is_one ? "filled cavity" : "filled cavities";
    case Removal::Reason::kSwallowed:
      return is_one ? "component in a filled cavity" : "components in filled cavities";
    case Removal::Reason::kSmall:
      return is_one ? "small component" : "small components";
    case Removal::Reason::kNotLargest:
      return is_one ? "component besides the largest" : "components besides the largest";
    case Removal::Reason::kNotSeeded:
      break;
  }
  return is_one ? "component without a seed" : "components without a seed";
}

FilteredSurface filtered(const Triangles& surface, const SolidFilter& filter) {
  if (const std::string error = filter.error(); !error.empty()) throw UsageError(error);
  Filter at_work(surface);
  if (filter.fill_cavities) at_work.fill_cavities();
  if (filter.min_volume_mm3 > 0) at_work.remove_small(filter.min_volume_mm3);
  if (filter.keep == Keep::kLargest) at_work.keep_largest();
  if (filter.keep == Keep::kSeeded) at_work.keep_seeded(filter.seeds_ras_mm);
  return std::move(at_work).result();
}

}  // namespace surf::mesh
