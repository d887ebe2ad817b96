// Boundary integrals of a density that depends on the normal.
#pragma once

#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/boundary_energy.h"

namespace surf::energy {

/// J(Gamma) = int_Gamma H(x, nu) dS (1.7).
///
/// dJ(Gamma; V) = int (kappa H + d_nu H) V - H_y . grad_Gamma V dS (Theorem 2.2.3), so g = H and
/// f = d_nu H + div_Gamma (H_y)_Gamma. Second derivative: Theorem 2.2.4, corrected
/// (docs/energies.md). Scalar product: alpha = H - H_y . nu + tr_Gamma H_yy / (Dim - 1), the mean
/// of the second derivative's matrix over the directions, beta = d_nunu H + 2 kappa d_nu H.
template <int Dim>
class AnisotropicIntegral : public BoundaryEnergy<Dim> {
 public:
  explicit AnisotropicIntegral(DensityPointer<Dim> H, int quadrature_order = 2);

  std::string name() const override { return "anisotropic-integral"; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const override;

  DensityPointer<Dim> H_;
  int quadrature_order_;
};

}  // namespace surf::energy
