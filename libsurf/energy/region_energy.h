// Energies of the domain that depend on integrals of functions of one field.
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/domain_integrals.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

struct DomainIntegralOptions {
  int quadrature_order = 2;
  /// Distance of the samples in the interior when J is computed from scratch [mm].
  double ray_spacing_mm = 1;
  /// The integrals count from the shape of the first reset, where they are 0: its interior is not
  /// sampled, and what surgery changes between two steps is not seen.
  bool counts_from_start = false;
};

/// J(Omega) = Phi(p), p_k = int_Omega w_k(I) dx. The integrals follow the surface: from scratch at
/// a reset, by what the boundary sweeps at a move, by the parts that surgery has rebuilt (from
/// scratch they took a third of an evolution of 260,000 triangles) and, where Phi is not linear, by
/// what mending changes: with it left out a disc's p drifted by 2 % in a thousand steps, and G with
/// it.
///
/// G = sum_k Phi_k w_k(I) (Theorem 2.2.6), g = 0; d2J = int (d_nu G + kappa G) V W dS at fixed
/// Phi_k plus the terms Phi_kl <w_k, V> <w_l, W> (Theorem 2.2.7).
template <int Dim>
class RegionEnergy : public ShapeEnergy<Dim> {
 public:
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override { return value_of(p_) - drift_; }
  double drift() const override { return drift_; }
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override;
  void rebuild(const fem::Geometry<Dim>& shape) override;
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;
  void add_density(const Points<Dim>&, double, Eigen::VectorXd&) const override;

  /// The integrals p over the current shape.
  const Eigen::VectorXd& integrals() const { return p_; }

 protected:
  /// @param w  the w_k
  RegionEnergy(std::shared_ptr<const Field<Dim>> I, Integrands w, int n_integrals,
               const DomainIntegralOptions& options);

  /// Whether p from scratch costs no more than what surgery has changed of it.
  virtual bool is_cheap_from_scratch() const { return false; }
  /// p from scratch.
  virtual Eigen::VectorXd integrals_over(const fem::Geometry<Dim>& shape) const;
  /// What p has more over `to` than over `from`, another mesh of nearly the same domain: the change
  /// of the content times the means of the w_k over the boundary.
  virtual Eigen::VectorXd change_between(const fem::Geometry<Dim>& from,
                                         const fem::Geometry<Dim>& to) const;

 private:
  virtual double value_of(const Eigen::VectorXd& p) const = 0;
  /// G and dG/dI as functions of I, at the current shape.
  virtual std::function<std::array<double, 2>(double)> density() const = 0;
  /// Phi_kl at the current shape; without rows where Phi is linear.
  virtual Eigen::MatrixXd second_of_integrals() const { return {}; }

  std::shared_ptr<const Field<Dim>> I_;
  Integrands w_;
  int n_integrals_, quadrature_order_;
  bool counts_from_start_;
  DomainIntegrals<Dim> integrals_;
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  Eigen::VectorXd p_, tried_p_;
  double drift_ = 0;
};

}  // namespace surf::energy
