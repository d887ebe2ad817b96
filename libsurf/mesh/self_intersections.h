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
/// Any soup of triangles will do. A grid and tests with doubles that leave room for rounding rule
/// out most pairs, so that exact predicates see few: about 0.2 microseconds per triangle and core
/// on a smooth surface with triangles of similar size; 1 (boxes sorted by CGAL) where sizes differ
/// by more than 4 times the mean. (tests/surf/mesh/self_intersections_test.cpp compares with
/// CGAL's.)
///
/// @pre  indices name points, and coordinates are finite
std::vector<std::pair<int, int>> self_intersections(const Triangles& surface);

/// Those of the pairs with an active triangle: where only some vertices moved, or where the rest
/// is known to be free of intersections.
/// @param active  one flag per triangle
std::vector<std::pair<int, int>> self_intersections(const Points<3>& points,
                                                    const Elements<3>& elements,
                                                    const std::vector<char>& active);

/// Whether these two triangles are such a pair. @pre  they are not degenerate
bool do_intersect(const Points<3>& points, const Elements<3>& elements, int first, int second);

/// Flags of the triangles whose corners are not where those of the triangle of the same
/// number were, and of those that are new.
std::vector<char> changed_triangles(const Triangles& before, const Triangles& after);

/// The pairs of changed triangles and others that intersect, if they are more than `before` has in
/// all, else none: what an operation with local checks asks for at its end.
std::vector<std::pair<int, int>> added_intersections(const Triangles& before,
                                                     const Triangles& after);

/// Triangles without area, exactly: collinear corners. Ascending.
std::vector<int> degenerate_triangles(const Triangles& surface);

}  // namespace surf::mesh
