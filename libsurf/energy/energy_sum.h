// Weighted sums of shape energies.
#pragma once

#include <memory>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// J = sum_i w_i J_i: what a flow minimises.
template <int Dim>
class EnergySum : public ShapeEnergy<Dim> {
 public:
  /// Adds a term; a weight of 0 adds nothing.
  void add(double weight, std::unique_ptr<ShapeEnergy<Dim>> energy);

  std::string name() const override;
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override;
  double drift() const override;
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override;
  void rebuild(const fem::Geometry<Dim>& shape) override;
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;
  void add_density(const Points<Dim>&, double, Eigen::VectorXd&) const override;

 private:
  struct Term {
    double weight;
    std::unique_ptr<ShapeEnergy<Dim>> energy;
  };
  std::vector<Term> terms_;
};

/// The minimal surface model (5.1): gamma_0 int_Gamma H dS + gamma int_Omega H dx.
/// gamma_0 is dimensionless, gamma is in 1/mm; gamma < 0 drives the shape outward.
template <int Dim>
void add_minimal_surface(EnergySum<Dim>& sum, std::shared_ptr<const Field<Dim>> H, double gamma_0,
                         double gamma, const DomainIntegralOptions& options);

}  // namespace surf::energy
