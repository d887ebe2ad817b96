// Mass matrices and loads of 3.5.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::fem {

/// Mass matrix with one weight per element: M_ij = <w phi_i, phi_j>, thesis 3.5 (M with w = 1,
/// M_g and M_beta with elementwise g and beta). Symmetric positive definite for w > 0.
/// @param w  (m)
/// @return   (n, n) [mm^(Dim-1) times the unit of w]
template <int Dim>
SparseMatrix mass(const Geometry<Dim>& shape, const Eigen::VectorXd& w);

/// The same for a weight given at the vertices, interpolated linearly: exact integral of
/// w phi_i phi_j.
template <int Dim>
SparseMatrix mass_nodal_weight(const Geometry<Dim>& shape, const Eigen::VectorXd& w);

}  // namespace surf::fem
