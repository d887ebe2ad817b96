// What a further click may add to an object on a search grid, or take away from it.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/click.h"
#include "libsurf/segment/rung.h"
#include "libsurf/segment/seed_view.h"
#include "libsurf/segment/settle_cut.h"

namespace surf::segment {

/// A click as a grid sees it.
template <int Dim>
struct GridClick {
  SeedNodes<Dim> seed;
  Side side = Side::kInside;
};

/// The box of an object and of all clicks, enlarged by half its extent and at least by 14 nodes;
/// with a box round the object all of the grid.
template <int Dim>
NodeBox<Dim> surroundings(const SearchGrid<Dim>& grid, const NodeSet<Dim>& before,
                          std::span<const GridClick<Dim>> clicks);

/// The surroundings of an object and of all clicks, in which a click is heeded.
template <int Dim>
struct ClickScene {
  const SearchGrid<Dim>& grid;         ///< of the surroundings alone; referred to
  const NodeSet<Dim>& before;          ///< the object so far, in its box; referred to
  std::vector<GridClick<Dim>> clicks;  ///< at least one; the last is the one to heed
  double noise = 0;                    ///< [intensity per node]

  const GridClick<Dim>& click() const { return clicks.back(); }
  const NodeBox<Dim>& box() const { return grid.box(); }
  /// The nodes round each click (3 along each axis) are held to its side, the clicks' own nodes
  /// before all, later clicks before earlier ones; faces beyond which the object cannot be are
  /// outside.
  std::vector<Held> held() const;
  /// Where the click may change something: off the object (an inside click) or in it, but not where
  /// clicks of the other side hold a node.
  NodeSet<Dim> domain() const;
};

/// Families of pieces R that hold the click:
///
///   - ladders (ladder.h) at the click in the domain: alike, brighter, darker, front
///   - inside clicks: ladders of all inside clicks together, each with its own mean
///   - competition: arrival times t of fronts, t_click / (t_click + t_others) <= 0.2 ... 0.7, the
///     others being the clicks of the other side
///   - necks, outside clicks: what a neck of some radius parts from all inside clicks
///   - the ball round the click, of half its distance to the end of the domain
///
/// Each in its own box, without nodes off the domain; unscored, but for the growth of a ladder.
/// What holds another click of the other side, or not this one, is left out.
template <int Dim>
std::vector<Rung<Dim>> pieces(const ClickScene<Dim>& scene, const std::stop_token& stop);

}  // namespace surf::segment
