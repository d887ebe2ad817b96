// Boundary energies that depend on integrals over the boundary.
#pragma once

#include <vector>

#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/boundary_energy.h"

namespace surf::energy {

/// A family of densities H(x, nu, p) and the integrals p_k = int_Gamma w_k(x, nu) dS that it
/// depends on (1.9). Thread-safe.
template <int Dim>
class DensityFamily {
 public:
  virtual ~DensityFamily() = default;
  /// The w_k.
  virtual const std::vector<DensityPointer<Dim>>& integrands() const = 0;
  /// H(., ., p), its derivative by p_k, and by p_k and p_l; null where they vanish.
  /// @param p  (n_integrands)
  virtual DensityPointer<Dim> at(const Eigen::VectorXd& p) const = 0;
  virtual DensityPointer<Dim> first(const Eigen::VectorXd& p, int k) const = 0;
  virtual DensityPointer<Dim> second(const Eigen::VectorXd& p, int k, int l) const = 0;
};

/// J(Gamma) = int_Gamma H(x, nu, p(Gamma)) dS with several integrals p: (1.9), with a normal.
///
/// With I_k = int_Gamma dH/dp_k dS, J has the derivative of the frozen density H + sum I_k w_k
/// (Theorem 2.2.8) and its second derivative plus rank-one terms (Theorem 2.2.9, in whose print
/// the (kappa^2 - sum kappa_i^2) (H + I_Hp w) V W of its proof is missing):
///   sum_k dA_k(V) dw_k(W) + dw_k(V) dA_k(W) + sum_kl I_kl dw_k(V) dw_l(W)
/// with dA_k, dw_k the derivatives of the integrals of dH/dp_k and w_k.
template <int Dim>
class BoundaryFunctional : public BoundaryEnergy<Dim> {
 public:
  explicit BoundaryFunctional(std::shared_ptr<const DensityFamily<Dim>> H,
                              int quadrature_order = 2);

  std::string name() const override { return "boundary-functional"; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;

 private:
  double evaluate(const fem::Geometry<Dim>& shape) const override;
  Eigen::VectorXd integrals(const fem::Geometry<Dim>& shape) const;
  double integral(const DensityPointer<Dim>& density, const fem::Geometry<Dim>& shape) const;
  struct Frozen;
  Frozen frozen() const;

  std::shared_ptr<const DensityFamily<Dim>> H_;
  int quadrature_order_;
};

/// J(Gamma) = (1 / |Gamma|) int_Gamma H(x, nu) dS: the average of Fua and Leclerc (H without the
/// normal) and of Desolneux et al. (edge alignment).
template <int Dim>
std::shared_ptr<const DensityFamily<Dim>> average(DensityPointer<Dim> H);

}  // namespace surf::energy
