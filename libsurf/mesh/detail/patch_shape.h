// Patches of triangles as corners: how near they are, how sharp, how far they turn. Private to
// improve().
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {

using Corners = std::array<Eigen::Vector3d, 3>;

/// To the closest point of a triangle; huge if it has no area.
double squared_distance(const Eigen::Vector3d& point, const Corners& t);

/// The triangle of a patch that is closest to a point.
std::size_t closest(const Eigen::Vector3d& point, const std::vector<Corners>& patch);

bool is_near(const Eigen::Vector3d& point, const std::vector<Corners>& patch, double distance);

/// Whether the centre of a star and the midpoints of its spokes are near a patch.
bool is_star_near(const std::vector<Corners>& star, const std::vector<Corners>& patch,
                  double distance);

/// Cosine of the smallest angle.
double sharpest(const std::vector<Corners>& patch);

/// Whether two normals are more than 60 degrees apart.
bool turns_too_far(const Eigen::Vector3d& before, const Eigen::Vector3d& now);

/// Longest edge from the first corners.
double longest_spoke(const std::vector<Corners>& star);

}  // namespace surf::mesh
