#include "libsurf/mesh/detail/surgery_region.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "libsurf/mesh/detail/grid_cells.h"
#include "libsurf/mesh/detail/winding_grid.h"

namespace surf::mesh {
namespace {

using State = RegionPlan::State;

constexpr int kAttempts = 4;  // of a plan that fails, with more cells in narrow parts
constexpr int kAttemptsIfLarge = 2;
// Of a region of so many triangles, and of such a share of all, each attempt takes about as long as
// to rebuild the whole surface: 0.4 and 0.5 s of a bone's meshwork of 250,000 triangles, none of
// whose larger regions was found to fit.
constexpr double kLarge = 4000, kLargeShare = 0.02;

/// The cells of a region, and those where thin parts are removed.
struct RegionCells {
  CubicGrid grid;
  GridCells cells, zone;

  /// @param box  the grid, without cells
  explicit RegionCells(const CubicGrid& box) : grid(box), cells(grid), zone(grid) {}
  RegionCells(const RegionCells&) = delete;  // the cells refer to the grid
  RegionCells& operator=(const RegionCells&) = delete;
};

/// Cells round the triangles of a region and, more of them, round its events; null if there were
/// too many.
std::unique_ptr<RegionCells> cover(const ConnectedSurface& surface, const std::vector<int>& events,
                                   const std::vector<int>& near, double resolution) {
  const std::optional<CubicGrid> grid = grid_round(surface, near, resolution);
  if (!grid) return nullptr;
  auto out = std::make_unique<RegionCells>(*grid);
  for (const int t : near) out->cells.set_at(surface.triangles, t);
  out->cells.dilate(1);
  for (const int t : events) out->zone.set_at(surface.triangles, t);
  GridCells at_events = out->zone;
  out->zone.dilate(1);
  at_events.dilate(2);
  out->cells.add(at_events);
  return out;
}

/// Adds the cells that meet triangles of the core alone: what the cells leave of them would be
/// holes of the patch.
void fill(const ConnectedSurface& surface, const std::vector<int>& core, RegionCells& region) {
  GridCells of_core(region.grid), of_others(region.grid);
  TriangleFlags is_core(surface.n_triangles(), 0);
  for (const int t : core) is_core[t] = 1;
  for (const int t : surface.triangles_near(region.grid.box()))
    (is_core[t] ? of_core : of_others).set_at(surface.triangles, t);
  of_core.subtract(of_others);
  region.cells.add(of_core);
}

/// The triangles that lines of a grid may cross, with the points that they have: in the order of
/// the surface's, by which crossings are found the same.
Triangles crossed_by_lines(const ConnectedSurface& surface, const CubicGrid& grid) {
  const std::vector<int> near = surface.triangles_near(grid.box(), 2);
  Triangles out;
  out.elements = surface.triangles.elements(near, Eigen::all);
  std::vector<int> used(out.elements.data(), out.elements.data() + out.elements.size());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  out.points = surface.triangles.points(used, Eigen::all);
  for (int& vertex : out.elements.reshaped())
    vertex = int(std::lower_bound(used.begin(), used.end(), vertex) - used.begin());
  return out;
}

/// What grows in the cells of a region, which may become more.
std::optional<GrownPart> grow_in(RegionCells& region, const ConnectedSurface& surface) {
  const Triangles crossed = crossed_by_lines(surface, region.grid);
  const WindingGrid winding(crossed.points, crossed.elements, region.grid);
  std::vector<std::uint8_t> inside = winding.inside();
  open_thin_parts(region.grid, region.zone, 0, inside);
  open_thin_parts(region.grid, region.zone, 1, inside);
  return grow(inside, winding, surface.n_vertices(), region.cells);
}

/// One attempt of a plan.
/// @param near  triangles of the region; some are added
/// @param core  of what was last removed, even if the plan fails
RegionPlan plan_with(const ConnectedSurface& surface, LargeParts& large,
                     const TriangleFlags& is_event, const std::vector<int>& events,
                     double resolution, std::vector<int>& near, std::vector<int>& core) {
  std::unique_ptr<RegionCells> region;
  RemovedTriangles removal;
  do {
    region = cover(surface, events, near, resolution);
    if (!region) return {};
    removal = choose_removal(surface, region->grid, near, region->cells);
    core = removal.core;
  } while (add_bridges(surface, removal, near));
  fill(surface, removal.core, *region);
  auto grown = grow_in(*region, surface);
  if (!grown) return {};
  if (grown->has_more_cells) {
    removal = choose_removal(surface, region->grid, removal.core, region->cells);
    core = removal.core;
  }
  if (auto wanted = remove_phantom_parts(surface, large, is_event, removal.is_removed);
      !wanted.empty())
    return {State::kWantsMore, {}, std::move(wanted)};
  JoinedRims joined = join_rims(surface, events, std::move(removal), std::move(*grown), resolution);
  if (!joined.patch) return {State::kFails, {}, std::move(joined.without_event)};
  return {State::kFits, std::move(*joined.patch), {}};
}

}  // namespace

RegionPlan plan_region(const ConnectedSurface& surface, LargeParts& large,
                       const TriangleFlags& is_event, const RegionRequest& request,
                       double resolution_mm) {
  std::vector<int> near = neighbourhood(surface, request.events, request.reach_mm);
  near.insert(near.end(), request.others.begin(), request.others.end());
  std::vector<int> core;
  RegionPlan plan = plan_with(surface, large, is_event, request.events, resolution_mm, near, core);
  const auto is_large = [&] {
    return double(near.size()) > std::max(kLarge, kLargeShare * surface.n_triangles());
  };
  for (int attempt = 1; attempt < kAttempts && plan.state == State::kFails; ++attempt) {
    if (is_large() && attempt >= kAttemptsIfLarge) break;
    if (!add_necks(surface, core, near)) break;
    plan = plan_with(surface, large, is_event, request.events, resolution_mm, near, core);
  }
  plan.is_large = is_large();
  return plan;
}

}  // namespace surf::mesh
