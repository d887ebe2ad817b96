// Fronts on a grid: when they arrive at each node, from some of them.
#pragma once

#include <span>
#include <vector>

#include "libsurf/segment/node_box.h"

namespace surf::segment {

/// Least sums of length times cost over all ways from the starts (Dijkstra), a step leading to any
/// of the 8 or 26 neighbours at the mean cost of both ends. Nodes of infinite cost are not entered.
/// The same for any order in which equal ones are visited. O(n log n).
///
/// @param cost      at each node of the box, > 0 [per node]
/// @param starts    where it is 0
/// @param max_nodes  the front stops when it has covered so many; infinity where it has not been
template <int Dim>
std::vector<float> arrival_times(const NodeBox<Dim>& box, const std::vector<float>& cost,
                                 std::span<const std::size_t> starts, std::size_t max_nodes);

/// The same for ways along which each step costs the difference of its ends' values and `length`
/// per node.
template <int Dim>
std::vector<float> geodesic_distances(const NodeBox<Dim>& box, const std::vector<float>& values,
                                      std::span<const std::size_t> starts, float length);

}  // namespace surf::segment
