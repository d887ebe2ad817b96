// The enclosed area or volume.
#pragma once

#include "libsurf/energy/boundary_energy.h"

namespace surf::energy {

/// J(Omega) = |Omega|, exact for the polygon or polyhedron: the term of a volume constraint with
/// its multiplier as weight. dJ(Omega; V) = int V dS; d2J = int kappa V W dS, so beta = kappa.
template <int Dim>
class Content : public BoundaryEnergy<Dim> {
 public:
  std::string name() const override { return "content"; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;
  void add_density(const Points<Dim>&, double, Eigen::VectorXd&) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const override { return shape.enclosed(); }
};

}  // namespace surf::energy
