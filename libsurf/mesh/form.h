// The form of the solid that a surface encloses: sphericity, principal axes, Feret diameters.
#pragma once

#include "libsurf/base/types.h"
#include "libsurf/mesh/feret.h"

namespace surf::mesh {

/// Area of the ball of equal volume by the surface's own (Wadell 1935),
///
///   pi^(1/3) (6 |V|)^(2/3) / A,
///
/// 1 for a ball, less for all else; 0 without an area.
double sphericity(const Triangles& surface);

/// The ellipsoid with the volume's second moments: its semi-axes are sqrt(5 lambda) for the
/// eigenvalues lambda of the covariance of the points inside.
struct PrincipalAxes {
  Vector<3> semi_axes_mm = Vector<3>::Zero();                ///< longest first
  Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();  ///< unit vectors in columns, RAS
  double elongation() const { return semi_axes_mm[0] / semi_axes_mm[1]; }  ///< >= 1
  double flatness() const { return semi_axes_mm[1] / semi_axes_mm[2]; }    ///< >= 1
};

/// Exact integrals over the polyhedron. The component of the first two directions with the largest
/// absolute value is positive; the three are right-handed.
/// @throws InvalidMesh  no volume is enclosed
PrincipalAxes principal_axes(const Triangles& surface);

struct Form {
  double sphericity = 0;
  PrincipalAxes axes;
  FeretDiameters feret;
};

/// All of it, of a closed surface.
/// @throws InvalidMesh  no volume is enclosed
Form form(const Triangles& surface);

}  // namespace surf::mesh
