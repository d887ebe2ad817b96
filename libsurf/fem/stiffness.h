// Stiffness matrices of 3.5 and the discrete curvature.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::fem {

/// Stiffness matrix of -div_G(alpha grad_G u): A_ij = <alpha grad_G phi_i, grad_G phi_j>,
/// thesis 3.5; with alpha = 1 the A of (3.53).
///
/// Symmetric positive semi-definite; constants span the kernel of each connected component.
/// With alpha = 1, row i of A X is the gradient of the length/area with respect to vertex i.
///
/// @param alpha  weight per element, (m), >= 0
/// @return       (n, n) [mm^(Dim-3)] for dimensionless alpha; every row has its diagonal entry
template <int Dim>
SparseMatrix stiffness(const Geometry<Dim>& shape, const Eigen::VectorXd& alpha);
/// alpha = 1, but 0 on the border, which does not move.
template <int Dim>
SparseMatrix stiffness(const Geometry<Dim>& shape);

/// The matrix N^T M^-1 A M^-1 N of (3.61) with lumped masses: (n_i . n_j) A_ij with the nodal
/// normals n_i, on the border with the directions. It acts on normal velocities as the second
/// variation of the area does.
/// @param A  stiffness(shape, 1)
template <int Dim>
SparseMatrix normal_stiffness(const Geometry<Dim>& shape, SparseMatrix A);

/// Mean curvature kappa (sum of the principal curvatures, positive on a ball) at the
/// vertices, (n) [1/mm]: kappa_i = n_i . (M^-1 A X)_i, the first two lines of (3.53) with
/// lumped masses.
template <int Dim>
Eigen::VectorXd mean_curvature(const Geometry<Dim>& shape, const SparseMatrix& A);

}  // namespace surf::fem
