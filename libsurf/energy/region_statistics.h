// Region energies that depend on integrals of functions of the intensity.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/domain_integrals.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// A function of several integrals with its derivatives.
struct StatisticsValue {
  double value = 0;
  Eigen::VectorXd gradient;  ///< (n_integrals)
  Eigen::MatrixXd hessian;   ///< (n_integrals, n_integrals), symmetric
};

/// Phi(p) and the functions w_k whose integrals over Omega are p_k.
struct StatisticsModel {
  std::vector<Profile> w;  ///< of the intensity, with derivatives
  std::function<StatisticsValue(const Eigen::VectorXd& p)> Phi;
};

struct StatisticsOptions {
  int quadrature_order = 2;
  double ray_spacing_mm = 1;  ///< see DomainIntegralOptions
};

/// J(Omega) = Phi(p), p_k = int_Omega w_k(I) dx: (1.10) where H is a sum of products of functions
/// of x and of p, with several integrals at once.
///
/// G = sum_k Phi_k w_k(I) (Theorem 2.2.6), g = 0; d2J = int (d_nu G + kappa G) V W dS at fixed
/// Phi_k plus the terms Phi_kl <w_k, V> <w_l, W> (Theorem 2.2.7). The integrals follow the surface.
template <int Dim>
class RegionStatistics : public ShapeEnergy<Dim> {
 public:
  RegionStatistics(std::string name, std::shared_ptr<const Field<Dim>> I, StatisticsModel model,
                   const StatisticsOptions& options);

  std::string name() const override { return name_; }
  void reset(const fem::Geometry<Dim>& shape) override;
  double value() const override { return model_.Phi(p_).value; }
  double try_move(const fem::Geometry<Dim>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<Dim>& shape) override;
  void differentiate(const fem::Curvature& curvature, double weight,
                     ShapeTerms<Dim>& terms) const override;
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           SecondDerivative<Dim>& second) const override;
  void add_density(const Points<Dim>& points, double weight,
                   Eigen::VectorXd& density) const override;

  /// The integrals over the current shape.
  const Eigen::VectorXd& integrals() const { return p_; }

 private:
  void evaluate_integrands(const Eigen::VectorXd& value, Eigen::MatrixXd& out) const;
  /// G and dG/dI as functions of I.
  std::function<std::array<double, 2>(double)> density() const;

  std::string name_;
  std::shared_ptr<const Field<Dim>> I_;
  StatisticsModel model_;
  StatisticsOptions options_;
  DomainIntegrals<Dim> integrals_;
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  Eigen::VectorXd p_, tried_p_;
};

/// Region competition with Gaussian statistics, means and variances of both sides:
///   J = sum_i |Omega_i| / 2 log((sigma_i^2 + eps^2 s^2) / s^2),
/// half the minus log likelihood of the intensities under their best normal distributions up to a
/// constant. Two textures of equal mean are told apart by their variance.
/// p = (|Omega|, int z, int z^2) with z = (I - mean) / s; mean and deviation s are those of the
/// whole image, so that J does not depend on the intensities' unit.
/// @param eps  a variance below (eps s)^2 counts as this
/// @throws UsageError  the image is constant
StatisticsModel region_competition(const ImageTotals& totals, double eps = 0.01);

}  // namespace surf::energy
