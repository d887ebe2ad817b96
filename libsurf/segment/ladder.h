// Wider and wider windows round clicks, opened at necks: regions that may be the object.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/rung.h"
#include "libsurf/segment/seed_view.h"

namespace surf::segment {

/// Of the grid: larger regions are no objects.
constexpr double kLargestShare = 0.6;

/// Of one family: how far each node is from the seeds, and the levels up to which a window goes.
struct Ladder {
  Family family = Family::kAlike;
  std::vector<float> distance;     ///< infinity where no window may go
  std::vector<double> levels;      ///< rising
  std::vector<double> neck_radii;  ///< r [nodes]: what hangs on by a thinner neck is cut off
  /// A window of more is the last one, and of its rungs those are left out that have more.
  double most_nodes = std::numeric_limits<double>::infinity();
};

/// Where the windows of a ladder may go, and how large the first one is that is worth a look.
template <int Dim>
struct LadderLimits {
  const NodeSet<Dim>* domain = nullptr;  ///< null = everywhere
  double least_nodes = 113;              ///< of a ball of 3 nodes
  double most_nodes = std::numeric_limits<double>::infinity();
};

/// Windows of rising half-widths a = deviation 2^(q/2), q = 2, 3, ..., up to one that holds 80 % of
/// the grid. With several seeds the mean is that of one of them, whichever is nearest.
///
/// Of fronts: the arrival times at a cost of 0.02 + (|grad I| / G)^2 per node, where G is well
/// above the slopes round the seeds and the noise; up to levels whose volumes grow by half; one
/// neck radius.
///
/// Of the first click, neck radii above 3 nodes count for windows |I - m| <= a alone: others gain
/// nothing by them. In a domain all do, and there are at most 18 windows.
template <int Dim>
Ladder make_ladder(const SeedView<Dim>& view, Family family, std::span<const double> neck_radii,
                   const LadderLimits<Dim>& limits = {});

/// Cost of a front per node: calm + (|grad I| / G)^2, see make_ladder.
template <int Dim>
std::vector<float> front_cost(const SeedView<Dim>& view, double calm);

/// The rungs of each window, one for each neck radius; those that are nowhere have no node.
template <int Dim>
using Windows = std::vector<std::vector<Rung<Dim>>>;

/// Of each window the component M of the seeds, and of that for each r the opening: the part of
/// {x in M: distance to the outside > r} that holds the seeds or is within 8 nodes of them, and
/// what lies within r of it in M, its holes filled. Each rung is scored by what its boundary looks
/// like, and by its growth from the window before and to the next. A window that holds more than
/// kLargestShare of the grid, or most_nodes, is the last one, and those of its rungs are left out
/// that do.
///
/// O(windows (1 + neck radii) nodes in the component's box); one thread per window.
///
/// @param done  called after each window, on any thread, with its rung of the first neck radius;
///              with null where there is none
/// @return  for each ladder; after a stop, of the windows that were done
template <int Dim>
std::vector<Windows<Dim>> climb(const SeedView<Dim>& view, std::span<const Ladder> ladders,
                                const std::function<void(const Rung<Dim>*)>& done,
                                const std::stop_token& stop);

}  // namespace surf::segment
