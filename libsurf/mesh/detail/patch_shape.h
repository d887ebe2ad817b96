// Patches of triangles as corners: how near they are, how sharp, how far they turn. Private to
// improve().
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {

using Corners = std::array<Eigen::Vector3d, 3>;

/// A patch that many points are compared with: triangles whose ball is further away than needs be
/// known are left out (with every triangle looked at, a fifth of the evolution of an organ).
class NearPatch {
 public:
  /// The patch must outlive this object.
  explicit NearPatch(const std::vector<Corners>& patch);

  /// The triangle that is closest to a point.
  std::size_t closest(const Eigen::Vector3d& point) const;
  bool is_near(const Eigen::Vector3d& point, double distance) const;

 private:
  struct Triangle {
    const Corners* corners;
    Eigen::Vector3d normal, centre;
    double radius;
  };

  /// To the closest point of a triangle; huge if it has no area.
  static double squared_distance(const Eigen::Vector3d& point, const Triangle& triangle);
  static bool is_beyond(const Eigen::Vector3d& point, const Triangle& triangle, double distance);

  std::vector<Triangle> triangles_;
};

/// The triangle of a patch that is closest to each point.
std::vector<std::size_t> closest_of(const std::vector<Corners>& patch,
                                    const std::vector<Eigen::Vector3d>& points);

/// Whether the centre of a star and the midpoints of its spokes are near a patch.
bool is_star_near(const std::vector<Corners>& star, const NearPatch& patch, double distance);

/// Cosine of the smallest angle.
double sharpest(const std::vector<Corners>& patch);

/// Whether two normals are more than 60 degrees apart.
bool turns_too_far(const Eigen::Vector3d& before, const Eigen::Vector3d& now);

/// Longest edge from the first corners.
double longest_spoke(const std::vector<Corners>& star);

}  // namespace surf::mesh
