// Weighted length or area, the geodesic active contour term.
#pragma once

#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// J(Gamma) = int_Gamma H dS, the first term of (1.6) and (5.1).
///
/// Derivative: dJ(Gamma; W) = int (grad H . W + H div_Gamma W) dS, G = H kappa + d_nu H
/// (Theorem 2.2.1), so g = H. Scalar product (5.1): alpha = H, beta = d_nunu H + 2 kappa d_nu H;
/// the (kappa^2 - sum kappa_i^2) H of Theorem 2.2.2 is left out as in 5.1.
template <int Dim>
class BoundaryIntegral : public ShapeEnergy<Dim> {
 public:
  explicit BoundaryIntegral(std::shared_ptr<const Field<Dim>> H, int quadrature_order = 2);

  std::string name() const override { return "boundary-integral"; }
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override { return value_; }
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override { reset(shape); }
  void differentiate(const fem::Curvature& curvature, double weight,
                     ShapeTerms<Dim>& terms) const override;
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           SecondDerivative<Dim>& second) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const;

  std::shared_ptr<const Field<Dim>> H_;
  int quadrature_order_;
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  double value_ = 0, tried_value_ = 0;
};

}  // namespace surf::energy
