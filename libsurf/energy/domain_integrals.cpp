#include "libsurf/energy/domain_integrals.h"

#include <algorithm>
#include <cmath>

#include "libsurf/fem/quadrature.h"

namespace surf::energy {
namespace {

constexpr int kMaxRaySamples = 4096;

/// measure * nu of every element of X_s, each at its q quadrature points: (m * q, Dim) rows
/// weight * area vector.
template <int Dim>
Points<Dim> weighted_normals(const fem::Geometry<Dim>& shape, const Eigen::VectorXd& weights) {
  const Eigen::Index q = weights.size();
  Points<Dim> out(shape.n_elements() * q, Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    out.middleRows(t * q, q).noalias() = weights * (shape.measures()[t] * shape.normals().row(t));
  return out;
}

}  // namespace

template <int Dim>
DomainIntegrals<Dim>::DomainIntegrals(int quadrature_order, double ray_spacing_mm, int n_integrands)
    : quadrature_order_(quadrature_order),
      ray_spacing_mm_(ray_spacing_mm),
      n_integrands_(n_integrands) {}

template <int Dim>
Eigen::VectorXd DomainIntegrals<Dim>::absolute(const Field<Dim>& field,
                                               const Integrands& integrands,
                                               const fem::Geometry<Dim>& shape) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const Eigen::Matrix<double, 1, Dim> centre = shape.points().colwise().mean();
  Points<Dim> rays = fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points);
  rays.rowwise() -= centre;
  const Eigen::VectorXd flux =
      rays.cwiseProduct(weighted_normals<Dim>(shape, rule.weights)).rowwise().sum();
  const double longest = rays.rowwise().norm().maxCoeff();
  const int n_samples =
      std::clamp(static_cast<int>(std::ceil(longest / ray_spacing_mm_)), 8, kMaxRaySamples);

  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n_integrands_);
  Samples<Dim> samples;
  Eigen::MatrixXd values(rays.rows(), n_integrands_);
  const auto& gauss = fem::quadrature<2>(3);  // two points on each interval of s
  for (int interval = 0; interval < n_samples; ++interval)
    for (Eigen::Index p = 0; p < gauss.size(); ++p) {
      const double s = (interval + gauss.points(p, 1)) / n_samples;
      const Points<Dim> x = (s * rays).rowwise() + centre;
      field.sample(x, Derivatives::kNone, samples);
      integrands(samples.value, values);
      sum += gauss.weights[p] / n_samples * std::pow(s, Dim - 1) * (values.transpose() * flux);
    }
  return sum;
}

template <int Dim>
Eigen::VectorXd DomainIntegrals<Dim>::swept(const Field<Dim>& field, const Integrands& integrands,
                                            const fem::Geometry<Dim>& from,
                                            const fem::Geometry<Dim>& to) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const Points<Dim> displacement = to.points() - from.points();
  const Points<Dim> d = fem::quadrature_points<Dim>(displacement, from.elements(), rule.points);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n_integrands_);
  Samples<Dim> samples;
  Eigen::MatrixXd values(d.rows(), n_integrands_);
  const auto& gauss = fem::quadrature<2>(3);
  for (Eigen::Index p = 0; p < gauss.size(); ++p) {
    const auto shape = from.moved_to(from.points() + gauss.points(p, 1) * displacement);
    field.sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
                 Derivatives::kNone, samples);
    integrands(samples.value, values);
    const Eigen::VectorXd flux =
        d.cwiseProduct(weighted_normals<Dim>(shape, rule.weights)).rowwise().sum();
    sum += gauss.weights[p] * (values.transpose() * flux);
  }
  return sum;
}

template class DomainIntegrals<2>;
template class DomainIntegrals<3>;

}  // namespace surf::energy
