// How far the vertices of flat elements stand beyond the bent edge that these follow in the mean.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::segment {

/// The offsets of the vertices [mm], positive along the normals; an element bends by them in its
/// mean by 2/3 of the height over its middle on a curve, by 3/4 on a surface.
/// @param normals  (n, Dim) unit, 0 where a vertex does not move
template <int Dim>
Eigen::VectorXd facet_offsets(const fem::Geometry<Dim>& geometry, const Points<Dim>& normals);

/// Deviations [mm] of which two hold 95 % of |N(offset, deviation)|, a part of the offset being
/// doubt of its own.
Eigen::VectorXd with_facet_offset(const Eigen::VectorXd& deviations,
                                  const Eigen::VectorXd& offsets);

}  // namespace surf::segment
