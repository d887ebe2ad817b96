// Boundary integrals of a density that depends on the mean curvature: energies of fourth order.
#pragma once

#include "libsurf/energy/boundary_energy.h"
#include "libsurf/energy/curvature_density.h"

namespace surf::energy {

/// J(Gamma) = int_Gamma H(x, kappa) dS (1.8), discretised as sum_i m_i H(x_i, kappa_i) with the
/// lumped masses and the curvatures kappa_i = (M^-1 A X)_i . nu_i, nu_i the normalised nodal
/// normal.
///
/// G = -Lap_Gamma H_z + H kappa - H_z sum kappa_i^2 + d_nu H (Theorem 2.2.5). It does not have the
/// form (1.13): g = 0, and the velocity needs the bilaplacian, whose weight is c = H_zz. The second
/// derivative is complete; docs/energies.md derives it. Where an irregular mesh makes kappa_i
/// noisy, so is J.
template <int Dim>
class CurvatureIntegral : public BoundaryEnergy<Dim> {
 public:
  explicit CurvatureIntegral(std::shared_ptr<const CurvatureDensity<Dim>> H);

  std::string name() const override { return "curvature-integral"; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;

 private:
  struct Form;
  double evaluate(const fem::Geometry<Dim>& shape) const override;
  CurvatureSamples<Dim> sample(const fem::Geometry<Dim>& shape, const Eigen::VectorXd& kappa,
                               Derivatives order) const;
  Form form(const fem::Curvature& curvature) const;

  std::shared_ptr<const CurvatureDensity<Dim>> H_;
};

}  // namespace surf::energy
