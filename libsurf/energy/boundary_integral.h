// Weighted length or area, the geodesic active contour term.
#pragma once

#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/boundary_energy.h"

namespace surf::energy {

/// J(Gamma) = int_Gamma H dS, the first term of (1.6) and (5.1).
///
/// Derivative: dJ(Gamma; W) = int (grad H . W + H div_Gamma W) dS, G = H kappa + d_nu H
/// (Theorem 2.2.1), so g = H. Scalar product (5.1): alpha = H, beta = d_nunu H + 2 kappa d_nu H;
/// the (kappa^2 - sum kappa_i^2) H of Theorem 2.2.2 is left out as in 5.1. It is part of
/// the second derivative.
template <int Dim>
class BoundaryIntegral : public BoundaryEnergy<Dim> {
 public:
  explicit BoundaryIntegral(std::shared_ptr<const Field<Dim>> H, int quadrature_order = 2);

  std::string name() const override { return "boundary-integral"; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const override;

  std::shared_ptr<const Field<Dim>> H_;
  int quadrature_order_;
};

}  // namespace surf::energy
