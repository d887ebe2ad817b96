// The boundary of the domain round which crossing curves wind, shared between sources of this
// library.
#pragma once

#include <string>
#include <vector>

#include "libcurve/mesh/intersections.h"
#include "libsurf/base/types.h"
#include "libsurf/flow/moving_shape.h"

namespace surf::curve {

struct Reconnection {
  /// Elements on the boundary, each with the domain on its left. Nodes of the input that are still
  /// used come first, in their order, bit for bit; then crossings, rounded.
  Segments curves;
  std::vector<int> kept_nodes;              ///< numbers of those nodes in the input, ascending
  std::vector<flow::TopologyEvent> events;  ///< from left to right
};

/// Where curves meet, elements are split at the exact points; pieces with winding numbers below one
/// on the right and at least one on the left stay. Pieces of one winding number follow each other
/// in runs between crossings, so one ray per run is enough: O((n + I) log n).
///
/// Where several pieces of the boundary meet in one point the parts of the domain are separated.
/// Rounding may make pieces meet anew: call again until there are no pairs.
/// @param pairs   intersections() of the curves
/// @param n_real  elements from here on are no curves but bridges (see surgery.h): what they do is
///                an event of the curves that they meet
/// @param scale   crossings this far apart along the boundary are one event [mm]; corners that
///                touch are cut by up to a fiftieth of it
/// @param crumb   components of less area do not count in what an event is called [mm^2]
Reconnection reconnect(const Segments& curves, const std::vector<ElementPair>& pairs, int n_real,
                       double scale, double crumb);

}  // namespace surf::curve
