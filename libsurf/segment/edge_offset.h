// The distance from the minimiser of the minimal surface model to the edge it stands for.
#pragma once

#include "libsurf/base/field.h"

namespace surf::segment {

/// Moves a curve or surface that minimises int_Gamma H dS (5.1) on to the edge.
///
/// At the minimiser kappa H + d_nu H = 0 while the edge is where d_nu H = 0, so the surface lies
/// delta = kappa H / d_nunu H inside a convex edge: 0.05 to 0.1 voxel on a ball, and not less on a
/// finer mesh. Each vertex moves by delta along its normal. delta is smoothed over three edge
/// lengths, (M + l^2 A)^-1 M, since mesh-scale ripples of kappa would be amplified; it is 0 where H
/// has no valley and limited to `limit_mm`.
template <int Dim>
Points<Dim> moved_to_edge(const Simplices<Dim>& surface, const Field<Dim>& H, double limit_mm);

}  // namespace surf::segment
