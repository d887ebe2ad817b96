// The closed polygons that bound a set of triangles. Private to surgery.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "libsurf/mesh/detail/connected_surface.h"

namespace surf::mesh {

using Side = std::pair<int, int>;  ///< vertices: from, to
using Rim = std::vector<int>;  ///< vertices of a closed polygon, the last one is next to the first

/// Sides of triangles that no other one runs through the other way, ascending. O(n log n).
std::vector<Side> free_sides(const std::vector<std::array<int, 3>>& triangles);

/// Sides of the chosen triangles of a surface that border on others, in the order of the triangles.
std::vector<Side> free_sides(const ConnectedSurface& surface, const TriangleFlags& is_chosen);

/// Vertices that begin more than one of the sides, where the triangles touch themselves.
/// @param sides  ascending
std::vector<int> crowded_vertices(const std::vector<Side>& sides);

/// Directed sides as closed polygons, each from its smallest vertex on; none where a vertex begins
/// more than one of them or a polygon does not close. O(n log n).
std::optional<std::vector<Rim>> rims(const std::vector<Side>& sides);

/// The polygon run through the other way.
inline Rim reversed(const Rim& rim) { return {rim.rbegin(), rim.rend()}; }

}  // namespace surf::mesh
