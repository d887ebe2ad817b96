// The distance from the minimiser of an energy to the edge it stands for.
#pragma once

#include "libsurf/energy/shape_energy.h"

namespace surf::segment {

/// Moves a curve or surface that minimises an energy on to the edge.
///
/// Two things keep a minimiser inside a convex edge. The length or area of its boundary terms:
/// where G = g kappa + f vanishes (1.13) f does not, and the edge is where it does, delta = g kappa
/// / beta further, beta the weight of (3.8), about the slope of G along the normal; for (5.1) this
/// is kappa H / d_nunu H, 0.05 to 0.1 voxel on a ball, and not less on a finer mesh. And the
/// smoothing of the image: a blur of deviation s moves levels and steepest places by s^2 kappa / 2.
/// Each vertex moves by the sum of both along its normal. It is smoothed over three edge lengths,
/// (M + l^2 A)^-1 M, since mesh-scale ripples of kappa would be amplified; it is 0 where beta is
/// not positive and limited.
///
/// @param energy    is reset to the shape
/// @param blur_mm   s, of the energy's fields
/// @param limit_mm  of a vertex
/// @return  the points; some of the elements may intersect
template <int Dim>
Points<Dim> moved_to_edge(const Simplices<Dim>& shape, energy::ShapeEnergy<Dim>& energy,
                          double blur_mm, double limit_mm);

}  // namespace surf::segment
