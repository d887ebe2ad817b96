// The triangles of marching cubes: closed, manifold surfaces for every choice of inside corners.
#pragma once

#include <array>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Corner c of a cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge (axis, corner) runs along the
/// axis from the corner, whose bit of that axis is 0.
struct CubeEdge {
  int axis, corner;
  Vector<3> middle() const {
    Vector<3> point(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    point[axis] = 0.5;
    return point;
  }
};

/// The edge of a number, which is axis * 8 + corner.
inline CubeEdge cube_edge(int number) { return {number / 8, number % 8}; }

/// Triangles that part the inside corners of a cube from the others, as triples of numbers of
/// edges, counter-clockwise seen from outside the object.
///
/// Cubes of a grid fit together: the surface is closed and 2-manifold. Corners that touch only
/// diagonally are not joined. With vertices in the middle of the edges it does not intersect
/// itself either.
/// @param inside  bit c is set if corner c is inside
const std::vector<std::array<int, 3>>& cube_triangles(int inside);

}  // namespace surf::mesh
