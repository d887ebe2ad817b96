// Value and derivatives of int_Gamma H(x, nu) dS from samples of H; private to energy/*.cpp.
#pragma once

#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// Samples of H at the quadrature points of all elements, element by element.
template <int Dim>
DensitySamples<Dim> sample_boundary(const AnisotropicDensity<Dim>& H,
                                    const fem::Geometry<Dim>& shape, int quadrature_order,
                                    Derivatives order);

template <int Dim>
double boundary_sum(const Eigen::VectorXd& value, const fem::Geometry<Dim>& shape,
                    int quadrature_order);

/// The derivative of the discrete integral by vertex, (n, Dim): Theorem 2.2.3 element by element,
/// sum over the quadrature points of w (phi_i H_x + H grad phi_i - (H_y . grad phi_i) nu), without
/// the second term on a border's rim (fem::Geometry).
/// @param H  first derivatives
template <int Dim>
Points<Dim> boundary_derivative(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                                int quadrature_order);

/// The derivative for the normal velocities phi_i n_i, (n).
template <int Dim>
Eigen::VectorXd boundary_load(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                              int quadrature_order);

/// Adds derivative, g = H, alpha = H - H_y . nu + tr_Gamma H_yy / (Dim - 1) and
/// beta = d_nunu H + 2 kappa d_nu H.
/// @param H          second derivatives
/// @param curvature  mean
template <int Dim>
void add_boundary_terms(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                        int quadrature_order, const Eigen::VectorXd& curvature, double weight,
                        ShapeTerms<Dim>& terms);

/// Adds the second derivative of Theorem 2.2.4, corrected:
///   int grad V . ((H - H_y . nu) Id + H_yy) grad W
///     + (d_nunu H + 2 kappa d_nu H + (kappa^2 - sum kappa_i^2) H) V W
///     - (kappa H_y + nu^T H_xy - S H_y) . (V grad W + W grad V) dS
/// with the shape operator S. The print has H + H_y . nu and no S H_y: there
/// d_nu grad_Gamma V = 0, but grad_Gamma V turns with the surface, d_nu grad_Gamma V = -S grad V.
/// @param H  second derivatives
template <int Dim>
void add_boundary_second(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                         int quadrature_order, const fem::Curvature& curvature, double weight,
                         SparseMatrix& second);

}  // namespace surf::energy
