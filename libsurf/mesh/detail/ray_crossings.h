// Where rays pass through a triangle surface, decided exactly.
#pragma once

#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/mesh/detail/edge_uses.h"

namespace surf::mesh {

/// A triangle that a ray along +x passes through.
struct RayCrossing {
  int ray;      ///< row of its origin
  int element;  ///< row of the triangle
  int sign;     ///< +1: from the triangle's back to its front, -1: the other way
};

/// All crossings of the rays from `origins` along +x, sorted by ray and triangle. The sum of
/// the signs of a closed, consistently oriented surface is its winding number round the origin.
///
/// By exact predicates on the coordinates, with half-open rules as if each ray were shifted by an
/// infinitesimal towards +y and a smaller one towards +z: a ray through an edge or a vertex
/// crosses as often as one beside it. An origin in a triangle does not cross it. O(n log k) for n
/// triangles and k rays, and a few ns for each pair of a triangle and a ray with common z.
///
/// @pre  indices name points, and coordinates are finite
std::vector<RayCrossing> ray_crossings(const Triangles& surface, const Points<3>& origins);

/// The vertex furthest along x of each component: where a ray begins that does not meet the
/// component itself.
std::vector<int> extreme_vertices(const Triangles& surface, const Components& parts);

}  // namespace surf::mesh
