// Initial surfaces: balls, ellipsoids, boxes and what is put together from them.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Sphere: an icosahedron whose edges are cut into k parts, projected; 20 k^2 triangles. k is the
/// least for which the mean edge, about 1.21 * radius / k, is not longer than edge_length; the
/// longest edge is 8 % longer than the mean. All vertices lie on the sphere.
/// @param center       world mm
/// @param radius       > 0 [mm]
/// @param edge_length  > 0 [mm]
/// @throws UsageError  radius or edge_length is not positive, or more than 20 million triangles
Triangles ball(const Eigen::Vector3d& center, double radius, double edge_length);

/// Ellipsoid { center + axes * u : |u| = 1 }: the image of a ball whose edges are short enough
/// along the longest axis.
/// @param axes         columns are the semi-axes [mm]; any invertible matrix
/// @throws UsageError  axes is singular; as for ball()
Triangles ellipsoid(const Eigen::Vector3d& center, const Eigen::Matrix3d& axes, double edge_length);

/// Box with edges along the axes, each face a grid of squares cut in two; the sharp edges of the
/// box are edges of the mesh.
/// @param lower, upper  corners, lower < upper in every coordinate [mm]
/// @param edge_length   longest side of the squares [mm]
/// @throws UsageError   lower >= upper somewhere; as for ball()
Triangles box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper, double edge_length);

/// Surfaces as one of several components: points and triangles one after the other.
Triangles joined(const std::vector<Triangles>& parts);

/// The same surface with its normals the other way.
Triangles flipped(Triangles surface);

}  // namespace surf::mesh
