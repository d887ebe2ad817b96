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
  void differentiate(const fem::Curvature& curvature, double weight,
                     ShapeTerms<Dim>& terms) const override;
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           SecondDerivative<Dim>& second) const override;
  void add_density(const Points<Dim>& points, double weight,
                   Eigen::VectorXd& density) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const override { return shape.enclosed(); }
};

}  // namespace surf::energy
