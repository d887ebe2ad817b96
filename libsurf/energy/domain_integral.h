// Weighted area or volume: balloon and region terms.
#pragma once

#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/domain_integrals.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

struct DomainIntegralOptions {
  int quadrature_order = 2;
  /// Distance of the samples in the interior when J is computed from scratch [mm].
  double ray_spacing_mm = 1;
};

/// J(Omega) = int_Omega F dx, the second term of (1.6) and (5.1) and every region term whose
/// integrand does not depend on the shape.
///
/// Derivative: dJ(Omega; W) = int_Gamma F W . nu dS (Lemma 2.1.1), so g = 0. Scalar product:
/// alpha = 0, beta = d_nu F + kappa F (second derivative, the gamma terms of Theorem 2.2.2).
template <int Dim>
class DomainIntegral : public ShapeEnergy<Dim> {
 public:
  DomainIntegral(std::shared_ptr<const Field<Dim>> F, const DomainIntegralOptions& options);

  std::string name() const override { return "domain-integral"; }
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override { return value_; }
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override;
  void rebuild(const fem::Geometry<Dim>& shape) override { remesh(shape); }
  void differentiate(const fem::Curvature& curvature, double weight,
                     ShapeTerms<Dim>& terms) const override;
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           SecondDerivative<Dim>& second) const override;
  void add_density(const Points<Dim>& points, double weight,
                   Eigen::VectorXd& density) const override;

 private:
  std::shared_ptr<const Field<Dim>> F_;
  DomainIntegralOptions options_;
  DomainIntegrals<Dim> integrals_;
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  double value_ = 0, tried_value_ = 0;
};

}  // namespace surf::energy
