// Ellipsoids and ellipses through clicked points.
#pragma once

#include "libsurf/base/types.h"

namespace surf::mesh {

/// { center + axes * u : |u| = 1 }
template <int Dim>
struct Ellipsoid {
  Vector<Dim> center;
  Eigen::Matrix<double, Dim, Dim> axes;  ///< columns: the semi-axes, at right angles, longest first
  double rms = 0;                        ///< root mean square of the points' distances from it [mm]
};

/// The ellipsoid next to the points in the sense of nonlinear least squares: of the distances to
/// first order, (|q| - 1) |q| / |A^-T q| with q = A^-1 (x - c) and A the axes, and, weakly, of how
/// much the logarithms of the axes' lengths differ and the centre is off the points' mean. So few
/// points, or such in a plane, give a round body; a score of them on an ellipsoid with axes 1:2 is
/// met to 1e-3. Points that hardly determine one, so that 200 iterations do not find the least, are
/// a warning in the log.
/// @param points  (n, Dim) on the boundary, n > Dim
/// @throws UsageError  too few points, or all on a line
template <int Dim>
Ellipsoid<Dim> fit_ellipsoid(const Points<Dim>& points);

}  // namespace surf::mesh
