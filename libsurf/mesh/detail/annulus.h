// A strip of triangles between two closed polygons: how a patch is joined to the surface round it.
#pragma once

#include <array>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Triangles of an annulus between two closed polygons, with no new vertex and the smallest sum of
/// squares of the edges between them that any such strip has which begins at their closest
/// vertices. O(n m) for n and m vertices.
///
/// The polygons run as the triangles' sides do: each edge (first[i], first[i + 1]) and
/// (second[j], second[j + 1]) is a directed side of one triangle. So on a flat annulus they run in
/// opposite directions.
/// @param first, second  rows of points, at least 3 each
std::vector<std::array<int, 3>> annulus(const Points<3>& points, const std::vector<int>& first,
                                        const std::vector<int>& second);

}  // namespace surf::mesh
