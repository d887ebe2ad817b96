// Keeps sheets of a moving surface apart.
#pragma once

#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Vertices that a step would bring into contact: those of every pair of triangles without a
/// common vertex that face each other (normals more than about 100 degrees apart), whose centroids
/// come closer than `distance` [mm] and closer than they were. A sweep along a grid
/// (close_pairs.h): linear time.
/// @return  one flag per vertex
std::vector<char> vertices_in_contact(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& elements, double distance);

/// The pairs of triangles (first < second) that are in contact in this sense.
std::vector<std::pair<int, int>> triangles_in_contact(const Points<3>& from, const Points<3>& to,
                                                      const Elements<3>& elements, double distance);

enum class HeldPairs {
  kAll,  ///< of intersecting triangles
  kNone  ///< only triangles without area or that turned over
};

/// Shortens a step where it makes triangles thin: the ways of the vertices of triangles of `to`
/// that have an angle below the least one, and a smaller one than before, are halved round after
/// round, after eight rounds taken back.
/// @param least_angle_deg  between 0 and 60
/// @return  number of vertices whose way was shortened
Eigen::Index hold_slivers(const Points<3>& from, Points<3>& to, const Elements<3>& elements,
                          double least_angle_deg);

/// Takes back what a step may not do: vertices of triangles of `to` that intersect, that have no
/// area or whose normal turned by 90 degrees or more are set to where they were, round after round;
/// after a few rounds with growing neighbourhoods, at last all of them. What `from` has already is
/// let be, so that a later step may undo it; a surface free of intersections stays so.
/// Each round looks at triangles that changed only.
/// @return  number of vertices set back
Eigen::Index hold_intersecting(const Points<3>& from, Points<3>& to, const Elements<3>& elements,
                               HeldPairs pairs = HeldPairs::kAll);

}  // namespace surf::mesh
