#include "libsurf/segment/outward_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace surf::segment {
namespace {

// Of the cubes [nodes]. With one of 20 to 54, or with two or three of them, the regions of 23
// structures have a mean Dice of 0.620 to 0.655, without 0.622: the smaller ones gain most.
constexpr std::array kHalfWidths = {24, 36};
constexpr double kMostOfGrid = 0.7;  // what a cube may hold of it to be worth its time
// Less may be a crumb of something larger (a hip bone ends at a piece of its marrow without; from
// 0.65 to 0.8 the mean Dice is the same).
constexpr double kLeastScore = 0.7;
constexpr int kMargin = 6;  // nodes, of the box of a region

/// Whether a region of a cube reaches a face that is none of the grid.
template <int Dim>
bool is_cut_off(const NodeBox<Dim>& grid, const NodeBox<Dim>& cube, const Rung<Dim>& rung) {
  const NodeBox<Dim> region = rung.inside.bounds(0);
  for (int axis = 0; axis < Dim; ++axis)
    if ((region.lower[axis] == 0 && cube.lower[axis] > 0) ||
        (region.upper()[axis] == cube.size[axis] && cube.upper()[axis] < grid.size[axis]))
      return true;
  return false;
}

/// Of the cube's own nodes, which count from 0, in the grid.
template <int Dim>
Rung<Dim> in_grid(const NodeBox<Dim>& grid, const NodeBox<Dim>& cube, Rung<Dim> rung) {
  auto first = rung.inside.box().lower;
  for (int axis = 0; axis < Dim; ++axis) first[axis] += cube.lower[axis];
  rung.inside = rung.inside.moved_to(first);
  auto lower = rung.inside.bounds(0).lower, upper = rung.inside.bounds(0).upper();
  for (int axis = 0; axis < Dim; ++axis) {
    lower[axis] = std::max(0, lower[axis] - kMargin);
    upper[axis] = std::min(grid.size[axis], upper[axis] + kMargin);
  }
  rung.inside = rung.inside.in(NodeBox<Dim>::between(lower, upper));
  return rung;
}

template <int Dim>
bool has_last_word(const NodeBox<Dim>& grid, const NodeBox<Dim>& cube,
                   const SearchedRegions<Dim>& searched) {
  if (searched.found.empty() || searched.found.front().score < kLeastScore ||
      is_cut_off(grid, cube, searched.found.front()))
    return false;
  return std::all_of(searched.settled.begin(), searched.settled.end(),
                     [&](const SettledRegion<Dim>& region) {
                       return !is_cut_off(grid, cube, region.rung) ||
                              region.rung.score * std::exp(region.rung.border_share) <
                                  searched.found.front().score;
                     });
}

/// What ends within the cube.
template <int Dim>
SearchedRegions<Dim> whole_ones(const NodeBox<Dim>& grid, const NodeBox<Dim>& cube,
                                SearchedRegions<Dim> searched) {
  std::erase_if(searched.found,
                [&](const Rung<Dim>& rung) { return is_cut_off(grid, cube, rung); });
  std::erase_if(searched.settled, [&](const SettledRegion<Dim>& region) {
    return is_cut_off(grid, cube, region.rung);
  });
  for (Rung<Dim>& rung : searched.found) rung = in_grid(grid, cube, std::move(rung));
  for (SettledRegion<Dim>& region : searched.settled)
    region.rung = in_grid(grid, cube, std::move(region.rung));
  return searched;
}

}  // namespace

template <int Dim>
SearchedRegions<Dim> search_outward(const SearchGrid<Dim>& grid, const Vector<Dim>& seed,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  const std::array seeds{seed};
  int n_done = 0;  // in all cubes so far
  if (Dim == 3 && !grid.has_outside_faces())
    for (const int half_width : kHalfWidths) {
      const NodeBox<Dim> cube = cube_round<Dim>(grid, seed, half_width);
      if (double(cube.n()) > kMostOfGrid * double(grid.box().n())) break;
      const int n_before = n_done;
      const SearchProgress<Dim> told = [&](int n, const Rung<Dim>* seen) {
        n_done = n_before + n;
        if (!progress) return true;
        if (!seen) return progress(n_done, nullptr);
        const Rung<Dim> here = in_grid(grid.box(), cube, *seen);
        return progress(n_done, &here);
      };
      SearchedRegions<Dim> searched =
          search_rungs<Dim>(grid.part(cube), seeds, options, told, stop);
      if (searched.was_stopped) return searched;
      if (has_last_word(grid.box(), cube, searched))
        return whole_ones(grid.box(), cube, std::move(searched));
    }
  SearchedRegions<Dim> out;
  out.was_stopped = !grid.make_all(stop);
  if (out.was_stopped) return out;
  return search_rungs<Dim>(
      grid, seeds, options,
      [&](int n, const Rung<Dim>* seen) { return !progress || progress(n_done + n, seen); }, stop);
}

#define SURF_INSTANTIATE(Dim)                                           \
  template SearchedRegions<Dim> search_outward<Dim>(                    \
      const SearchGrid<Dim>&, const Vector<Dim>&, const SearchOptions&, \
      const SearchProgress<Dim>&, const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
