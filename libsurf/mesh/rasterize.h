// Label maps of triangle surfaces on any affine grid.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// 1 for every grid point inside the surface, 0 for the others; i fastest.
///
/// Inside is a non-zero winding number, so that cavities are outside, overlapping parts are
/// inside once, and it does not matter whether the normals point outward or inward or the
/// affine is mirrored. The surface must be closed and consistently oriented (else rays leak: whole
/// rows may be wrong); it may be non-manifold, intersect itself and reach out of the grid. A grid
/// point on the surface is inside where the object lies towards growing i.
///
/// Exact up to rounding of the crossings' coordinates (1e-15 of the size), and never
/// inconsistent: every crossing of an edge with a grid plane is one number for both its
/// triangles, all comparisons are half-open, so each ray is entered as often as left, through
/// vertices and edges too. O(triangles + crossings + grid points).
///
/// @param size            grid points along i, j, k
/// @param index_to_world  grid point (i, j, k) to RAS mm; invertible
std::vector<std::uint8_t> rasterize(const Triangles& surface, const std::array<int, 3>& size,
                                    const Eigen::Affine3d& index_to_world);

}  // namespace surf::mesh
