#include "libsurf/energy/boundary_integral.h"

#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {

template <int Dim>
BoundaryIntegral<Dim>::BoundaryIntegral(std::shared_ptr<const Field<Dim>> H, int quadrature_order)
    : H_(std::move(H)), quadrature_order_(quadrature_order) {}

template <int Dim>
double BoundaryIntegral<Dim>::evaluate(const fem::Geometry<Dim>& shape) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  Samples<Dim> samples;
  H_->sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
             Derivatives::kNone, samples);
  double sum = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    sum += shape.charged_measures()[t] *
           rule.weights.dot(samples.value.segment(t * rule.size(), rule.size()));
  return sum;
}

template <int Dim>
void BoundaryIntegral<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                          ShapeTerms<Dim>& terms) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const auto& shape = this->shape();
  const Elements<Dim>& T = shape.elements();
  Samples<Dim> samples;
  H_->sample(fem::quadrature_points<Dim>(shape.points(), T, rule.points), Derivatives::kSecond,
             samples);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    if (shape.place(t) == fem::Place::kBorder) continue;
    const Vector<Dim> nu = shape.normals().row(t);
    const double measure = shape.charged_measures()[t];
    double mean_H = 0;
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const double H = samples.value[at];
      const Vector<Dim> grad_H = samples.gradient.row(at);
      const Eigen::Map<const Eigen::Matrix<double, Dim, Dim>> hessian(
          samples.hessian.row(at).data());
      double kappa = 0;
      for (int i = 0; i < Dim; ++i) kappa += rule.points(q, i) * curvature.mean[T(t, i)];
      const double beta = nu.dot(hessian * nu) + 2 * kappa * grad_H.dot(nu);
      mean_H += rule.weights[q] * H;
      for (int i = 0; i < Dim; ++i) {
        const double w = weight * rule.weights[q] * measure * rule.points(q, i);
        terms.derivative.row(T(t, i)) += w * grad_H;
        terms.beta[T(t, i)] += w * beta / shape.lumped_mass()[T(t, i)];
        terms.g[T(t, i)] += w * H / shape.lumped_mass()[T(t, i)];
      }
    }
    terms.alpha[t] += weight * mean_H;
    if (shape.place(t) == fem::Place::kRim) continue;
    for (int i = 0; i < Dim; ++i)  // H div_Gamma(phi_i e_k) = H d_k phi_i
      terms.derivative.row(T(t, i)) += weight * mean_H * measure * shape.basis_gradients(t).row(i);
  }
}

template <int Dim>
void BoundaryIntegral<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                                SecondDerivative<Dim>& second) const {
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  const auto& shape = this->shape();
  const Eigen::VectorXd gauss = curvature.mean.cwiseAbs2() - curvature.square_sum;  // 2 K
  Samples<Dim> samples;
  H_->sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
             Derivatives::kSecond, samples);
  add_element_matrices<Dim>(shape, weight, second.sparse, [&](Eigen::Index t) {
    const Vector<Dim> nu = shape.normals().row(t);
    const auto& gradients = shape.basis_gradients(t);
    Eigen::Matrix<double, Dim, Dim> local = Eigen::Matrix<double, Dim, Dim>::Zero();
    double mean_H = 0;
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const Vector<Dim> phi = rule.points.row(q);
      const Eigen::Map<const Eigen::Matrix<double, Dim, Dim>> hessian(
          samples.hessian.row(at).data());
      const double H = samples.value[at];
      const double mass =
          nu.dot(hessian * nu) +
          2 * at_point<Dim>(curvature.mean, shape, t, phi) * samples.gradient.row(at).dot(nu) +
          at_point<Dim>(gauss, shape, t, phi) * H;
      mean_H += rule.weights[q] * H;
      local += rule.weights[q] * mass * phi * phi.transpose();
    }
    local += mean_H * gradients * gradients.transpose();
    return Eigen::Matrix<double, Dim, Dim>(shape.measures()[t] * local);
  });
}

template class BoundaryIntegral<2>;
template class BoundaryIntegral<3>;

}  // namespace surf::energy
