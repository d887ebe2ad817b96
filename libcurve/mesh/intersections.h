// Which elements of a set of segments intersect, by a tree of boxes and exact predicates.
#pragma once

#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

using ElementPair = std::pair<int, int>;  ///< first < second

/// All pairs of elements that meet, ascending. Two elements that share a node meet if they have
/// more than it in common, all others if their closed segments have a common point: crossing,
/// touching and overlapping alike. Exact. Elements of no length are points.
///
/// Linear time for n elements in any order that bound shapes of bounded curvature, with a worst
/// case of O(n^2) for segments that form no curves.
/// @throws InvalidMesh  an element names a point that is missing or not finite
std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements);

/// The same pairs, only those of which an element is flagged (one flag per element).
std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements,
                                       const std::vector<char>& flagged);

/// Pairs of elements without a common node whose boxes come closer than `distance` [mm] in both
/// axes, ascending: candidates for what is near.
std::vector<ElementPair> near_pairs(const Points<2>& points, const Elements<2>& elements,
                                    double distance);

}  // namespace surf::curve
