#include "libsurf/energy/region_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"

namespace surf::energy {
namespace {

/// V / 2 log(Q/V - (S/V)^2 + eps^2) of p = (V, S, Q), with derivatives: with
/// D = Q V - S^2 + eps^2 V^2 it is V L / 2, L = log D - 2 log V.
StatisticsValue gaussian_cost(const Eigen::Vector3d& p, double eps_squared) {
  const double V = p[0], S = p[1], Q = p[2];
  const double smallest = 0.5 * eps_squared * V * V;  // rounding may leave less
  const double D = std::max(Q * V - S * S + eps_squared * V * V, smallest);
  const Eigen::Vector3d dD(Q + 2 * eps_squared * V, -2 * S, V);
  Eigen::Matrix3d d2D = Eigen::Matrix3d::Zero();
  d2D(0, 0) = 2 * eps_squared;
  d2D(1, 1) = -2;
  d2D(0, 2) = d2D(2, 0) = 1;
  const Eigen::Vector3d e = Eigen::Vector3d::UnitX();
  const double L = std::log(D) - 2 * std::log(V);
  const Eigen::Vector3d dL = dD / D - 2 / V * e;
  const Eigen::Matrix3d d2L =
      d2D / D - dD * dD.transpose() / (D * D) + 2 / (V * V) * e * e.transpose();
  StatisticsValue out;
  out.value = V * L / 2;
  out.gradient = (L * e + V * dL) / 2;
  out.hessian = (e * dL.transpose() + dL * e.transpose() + V * d2L) / 2;
  return out;
}

Integrands integrands(const std::vector<Profile>& w) {
  return [w](const Eigen::VectorXd& value, Eigen::MatrixXd& out) {
    for (std::size_t k = 0; k < w.size(); ++k)
      for (Eigen::Index i = 0; i < value.size(); ++i) out(i, k) = w[k](value[i])[0];
  };
}

}  // namespace

template <int Dim>
RegionStatistics<Dim>::RegionStatistics(std::string name, std::shared_ptr<const Field<Dim>> I,
                                        const StatisticsModel& model,
                                        const StatisticsOptions& options)
    : RegionEnergy<Dim>(std::move(I), integrands(model.w), static_cast<int>(model.w.size()),
                        options),
      name_(std::move(name)),
      model_(model) {}

template <int Dim>
std::function<std::array<double, 2>(double)> RegionStatistics<Dim>::density() const {
  return [this, slope = model_.Phi(this->integrals()).gradient](double I) {
    std::array<double, 2> G = {0, 0};
    for (std::size_t k = 0; k < model_.w.size(); ++k) {
      const auto w = model_.w[k](I);
      G[0] += slope[k] * w[0];
      G[1] += slope[k] * w[1];
    }
    return G;
  };
}

template <int Dim>
Eigen::MatrixXd RegionStatistics<Dim>::second_of_integrals() const {
  return model_.Phi(this->integrals()).hessian;
}

StatisticsModel region_competition(const ImageTotals& totals, double eps) {
  const double mean = totals.intensity / totals.content;
  const double variance = totals.intensity_squared / totals.content - mean * mean;
  if (!(variance > 0))
    throw UsageError(fmt::format(
        "region-competition: the intensity is {:g} everywhere, so no regions differ", mean));
  const double s = std::sqrt(variance);
  StatisticsModel model;
  model.w = {[](double) {
               return std::array<double, 3>{1, 0, 0};
             },
             [=](double I) {
               return std::array<double, 3>{(I - mean) / s, 1 / s, 0};
             },
             [=](double I) {
               const double z = (I - mean) / s;
               return std::array<double, 3>{z * z, 2 * z / s, 2 / (s * s)};
             }};
  const Eigen::Vector3d whole(totals.content, 0, totals.content);
  model.Phi = [whole, eps](const Eigen::VectorXd& p) {
    StatisticsValue inside = gaussian_cost(p, eps * eps);
    const StatisticsValue outside = gaussian_cost(whole - p, eps * eps);
    inside.value += outside.value;
    inside.gradient -= outside.gradient;
    inside.hessian += outside.hessian;
    return inside;
  };
  return model;
}

template class RegionStatistics<2>;
template class RegionStatistics<3>;

}  // namespace surf::energy
