// Pairs of triangles that intersect where they should not.
#pragma once

#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// All pairs (first < second) of triangles that have a point in common beyond the vertices
/// and edges they share by index, in ascending order; exact, and the same for any number
/// of threads. As CGAL's self_intersections counts: two triangles with a common edge intersect
/// if one is folded onto the other, with a common vertex if they meet elsewhere too; touching
/// is intersecting. Degenerate (collinear) triangles take part in no pair; mesh/verify.h
/// counts them.
///
/// Any soup of triangles will do. About 1 microsecond per triangle and core where few boxes
/// overlap. (tests/surf/mesh/self_intersections_test.cpp compares with CGAL's.)
///
/// @pre  indices name points, and coordinates are finite
std::vector<std::pair<int, int>> self_intersections(const Triangles& surface);

/// Triangles without area, exactly: collinear corners. Ascending.
std::vector<int> degenerate_triangles(const Triangles& surface);

}  // namespace surf::mesh
