// The curvatures of a shape at its vertices.
#pragma once

#include <vector>

#include "libsurf/fem/geometry.h"

namespace surf::fem {

/// The two functions of the principal curvatures kappa_i that shape derivatives need.
struct Curvature {
  Eigen::VectorXd mean;        ///< (n) [1/mm]: kappa = sum kappa_i, positive on a ball
  Eigen::VectorXd square_sum;  ///< (n) [1/mm^2]: sum kappa_i^2 = kappa^2 - 2 K
};

/// kappa as in mean_curvature; K = 0 on curves, on surfaces the angle defect over the lumped mass,
/// so that sum_i m_i K_i = 2 pi chi exactly. Where rounding or an irregular mesh has its say
/// square_sum may lie below kappa^2 / 2. On the border, where only a part of the shape is known,
/// both are 0.
/// @param A  stiffness(shape, 1)
template <int Dim>
Curvature curvature(const Geometry<Dim>& shape, const SparseMatrix& A);

/// The shape operator S = grad_Gamma nu of every element, symmetric and tangential, from the
/// nodal normals of unit length; its trace approximates kappa.
template <int Dim>
std::vector<Eigen::Matrix<double, Dim, Dim>> shape_operators(const Geometry<Dim>& shape);

}  // namespace surf::fem
