// Region energies that depend on integrals of functions of the intensity.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/region_energy.h"

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

using StatisticsOptions = DomainIntegralOptions;

/// J(Omega) = Phi(p), p_k = int_Omega w_k(I) dx: (1.10) where H is a sum of products of functions
/// of x and of p, with several integrals at once.
template <int Dim>
class RegionStatistics : public RegionEnergy<Dim> {
 public:
  RegionStatistics(std::string name, std::shared_ptr<const Field<Dim>> I,
                   const StatisticsModel& model, const StatisticsOptions& options);

  std::string name() const override { return name_; }

 private:
  double value_of(const Eigen::VectorXd& p) const override { return model_.Phi(p).value; }
  std::function<std::array<double, 2>(double)> density() const override;
  Eigen::MatrixXd second_of_integrals() const override;

  std::string name_;
  StatisticsModel model_;
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
