// What a reconnection did to the topology of curves, shared between sources of this library.
#pragma once

#include <vector>

#include "libcurve/mesh/detail/boundary_runs.h"
#include "libsurf/flow/moving_shape.h"

namespace surf::curve {

/// Crossings that pieces off the boundary, bridges and short runs join are one event; events are
/// taken one after the other from left to right and called by the cycles that each changes.
/// Parameters as those of reconnect().
std::vector<flow::TopologyEvent> topology_events(const Segments& curves, const BoundaryRuns& runs,
                                                 int n_real, double scale, double crumb);

}  // namespace surf::curve
