// How far the smoothness that is assumed of an edge may have rounded it off.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::segment {

/// Deviations [mm] of what is taken for smooth below a length L: c h L^2 Var(kappa), the variance
/// of the mean curvature kappa along the shape within some cells of length h. A ball has none,
/// whatever its radius: smoothing of the curvature leaves it as it is.
/// @param shape  where the edges were located; what lies on the image's border, or is held, does
/// not
///               count
/// @param cell_mm  h
/// @param length_mm  L, see SmoothMoves
/// @return  (n)
template <int Dim>
Eigen::VectorXd bend_doubts(const fem::Geometry<Dim>& shape, double cell_mm, double length_mm);

}  // namespace surf::segment
