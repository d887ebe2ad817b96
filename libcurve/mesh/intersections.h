// Which elements of a set of segments intersect: a sweep and a tree of boxes, both with exact
// predicates.
#pragma once

#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

using ElementPair = std::pair<int, int>;  ///< first < second

enum class Detection {
  kBoxes,  ///< tree of boxes along the curves and exact predicates: the faster one, docs/curves.md
  kSweep   ///< line sweep, thesis Alg. 9
};

/// All pairs of elements that meet, ascending. Two elements that share a node meet if they have
/// more than it in common, all others if their closed segments have a common point: crossing,
/// touching and overlapping alike. Exact. Elements of no length are points.
///
/// kBoxes is linear time for n elements in any order that bound shapes of bounded curvature, with
/// a worst case of O(n^2) for segments that form no curves; kSweep is O((n + I) log n) for any, I
/// the number of pairs.
/// @throws InvalidMesh  an element names a point that is missing or not finite
std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements,
                                       Detection detection = Detection::kBoxes);

/// The same pairs, only those of which an element is flagged (one flag per element). By boxes.
std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements,
                                       const std::vector<char>& flagged);

/// Pairs of elements without a common node whose boxes come closer than `distance` [mm] in both
/// axes, ascending: candidates for what is near. By boxes.
std::vector<ElementPair> near_pairs(const Points<2>& points, const Elements<2>& elements,
                                    double distance);

/// A point where elements meet.
struct Crossing {
  Vector<2> place;            ///< rounded [mm]
  std::vector<int> elements;  ///< all that contain the point, ascending
};

/// Algorithm 9: all points where elements meet as defined above, from left to right, those above
/// each other from bottom to top. Of an overlap, its leftmost point and every other end of an
/// element in it.
std::vector<Crossing> ordered_crossings(const Points<2>& points, const Elements<2>& elements);

}  // namespace surf::curve
