// Weighted area or volume: balloon and region terms.
#pragma once

#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/region_energy.h"

namespace surf::energy {

/// J(Omega) = int_Omega F dx, the second term of (1.6) and (5.1) and every region term whose
/// integrand does not depend on the shape.
///
/// Derivative: dJ(Omega; W) = int_Gamma F W . nu dS (Lemma 2.1.1), so g = 0. Scalar product:
/// alpha = 0, beta = d_nu F + kappa F (second derivative, the gamma terms of Theorem 2.2.2).
template <int Dim>
class DomainIntegral : public RegionEnergy<Dim> {
 public:
  DomainIntegral(std::shared_ptr<const Field<Dim>> F, const DomainIntegralOptions& options);

  std::string name() const override { return "domain-integral"; }
  void rebuild(const fem::Geometry<Dim>& shape) override { this->remesh(shape); }

 private:
  double value_of(const Eigen::VectorXd& p) const override { return p[0]; }
  std::function<std::array<double, 2>(double)> density() const override;
};

}  // namespace surf::energy
