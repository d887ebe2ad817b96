// Curves of a level of values on a grid.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>

#include "libsurf/base/types.h"

namespace surf::curve {

/// The curves between the nodes above a level and the others: marching squares with nodes where the
/// values, linear along the grid's edges, reach the level, but at least a twentieth of an edge from
/// its ends. Closed and simple, the domain on the left for every affine, mirrored ones too; empty
/// if no node is above. Nodes that touch only diagonally are not joined. What is cut off at the
/// grid's border is closed half a step outside.
/// @param values  size[0] * size[1], i fastest, finite
Segments curve_of_level(std::span<const float> values, const std::array<int, 2>& size,
                        const Eigen::Affine2d& index_to_world, double level);

}  // namespace surf::curve
