// Keeps sheets of a moving surface apart.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Vertices that a step would bring into contact: those of every pair of triangles without a
/// common vertex that face each other (normals more than about 100 degrees apart), whose centroids
/// come closer than `distance` [mm] and closer than they were. A hash grid over the centroids:
/// linear time.
/// @return  one flag per vertex
std::vector<char> vertices_in_contact(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& elements, double distance);

}  // namespace surf::mesh
