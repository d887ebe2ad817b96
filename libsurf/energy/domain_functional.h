// Domain energies whose density depends on integrals over the domain.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/domain_integrals.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// A family of densities H(x, p) and the integrals p_k = int_Omega w_k(x) dx that it depends on
/// (1.10). Thread-safe.
template <int Dim>
class FieldFamily {
 public:
  using Pointer = std::shared_ptr<const Field<Dim>>;
  virtual ~FieldFamily() = default;
  /// The w_k.
  virtual const std::vector<Pointer>& integrands() const = 0;
  /// H(., p), its derivative by p_k, and by p_k and p_l; null where they vanish.
  /// @param p  (n_integrands)
  virtual Pointer at(const Eigen::VectorXd& p) const = 0;
  virtual Pointer first(const Eigen::VectorXd& p, int k) const = 0;
  virtual Pointer second(const Eigen::VectorXd& p, int k, int l) const = 0;
};

/// J(Omega) = int_Omega H(x, p(Omega)) dx with several integrals p (1.10), for any H: every trial
/// of a step costs an integral over the whole domain. RegionStatistics is the faster way where J is
/// a function of integrals alone.
///
/// With I_k = int_Omega dH/dp_k dx: G = H + sum I_k w_k (Theorem 2.2.6), g = 0; second derivative:
/// Theorem 2.2.7 for several integrals.
template <int Dim>
class DomainFunctional : public ShapeEnergy<Dim> {
 public:
  DomainFunctional(std::shared_ptr<const FieldFamily<Dim>> H, const DomainIntegralOptions& options);

  std::string name() const override { return "domain-functional"; }
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override { return value_; }
  double drift() const override { return drift_; }
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override;
  void rebuild(const fem::Geometry<Dim>& shape) override;
  void differentiate(const fem::Curvature&, double, ShapeTerms<Dim>&) const override;
  void differentiate_twice(const fem::Curvature&, double, SecondDerivative<Dim>&) const override;
  void add_density(const Points<Dim>&, double, Eigen::VectorXd&) const override;

 private:
  using Pointer = typename FieldFamily<Dim>::Pointer;
  double integral(const Pointer& field) const;
  double swept(const Pointer& field, const fem::Geometry<Dim>& moved) const;
  /// The fields of G = H + sum I_k w_k with their factors.
  std::vector<std::pair<double, Pointer>> gradient_fields() const;

  std::shared_ptr<const FieldFamily<Dim>> H_;
  DomainIntegralOptions options_;
  DomainIntegrals<Dim> integrals_;
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  Eigen::VectorXd p_, tried_p_;
  double value_ = 0, tried_value_ = 0, drift_ = 0;
  std::optional<double> base_;  // the integral of H(., p_) over the current mesh, when it is known
};

}  // namespace surf::energy
