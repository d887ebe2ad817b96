// Shape of single triangles: normals and angles, cheap enough for inner loops.
#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// Normal of length 2 * area [mm^2].
inline Eigen::Vector3d area_normal(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& c) {
  return (b - a).cross(c - a);
}

/// Angle between two vectors, 0 to pi; exact near 0, where acos is not.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Cosines of the largest and of the smallest angle of a triangle. Comparing cosines spares
/// acos. A triangle without area (two or three equal points, or a line) counts as 0 and 180
/// degrees.
struct AngleCosines {
  double widest;    ///< of the largest angle
  double sharpest;  ///< of the smallest angle
};
AngleCosines angle_cosines(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           const Eigen::Vector3d& c);
AngleCosines angle_cosines(const TriMesh& mesh, OpenMesh::FaceHandle face);

/// Angles at the three vertices of each face in rows as elements() has them, (n_faces, 3)
/// [degrees].
Points<3> angles_deg(const TriMesh& mesh);

/// Volume inside the surface, by the divergence theorem from the centre of its points [mm^3].
double enclosed_volume(const TriMesh& mesh);

/// Area of the surface [mm^2].
double surface_area(const TriMesh& mesh);

/// cos of an angle in degrees.
double cos_deg(double degrees);

}  // namespace surf::mesh
