// Shape of single triangles: normals and angles, cheap enough for inner loops.
#pragma once

#include <Eigen/Dense>

#include "libsurf/base/products.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// Normal of length 2 * area [mm^2].
inline Eigen::Vector3d area_normal(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& c) {
  return (b - a).cross(c - a);
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

/// cos of an angle in degrees.
double cos_deg(double degrees);

}  // namespace surf::mesh
