// Moves of a shape where only those of some of its vertices are known.
#pragma once

#include <vector>

#include "libsurf/fem/geometry.h"

namespace surf::segment {

/// The moves u along the normals as they are where they are known; elsewhere they fade away from
/// those, -div grad u + u / reach^2 = 0, by P1 elements with lumped mass. O(n) for n vertices, but
/// for a sparse Cholesky factor.
/// @param moves     (n) [mm]
/// @param is_known  one flag per vertex
/// @throws std::logic_error  the system cannot be solved
template <int Dim>
Eigen::VectorXd faded_moves(const fem::Geometry<Dim>& geometry, const Eigen::VectorXd& moves,
                            const std::vector<char>& is_known, double reach_mm);

}  // namespace surf::segment
