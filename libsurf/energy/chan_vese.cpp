#include "libsurf/energy/chan_vese.h"

#include <algorithm>

#include "libsurf/fem/quadrature.h"

namespace surf::energy {
namespace {

constexpr int kAntiderivativeOrder = 4;  // P is smoother than I, elements a few cells long

void one_and_value(const Eigen::VectorXd& value, Eigen::MatrixXd& out) {
  out.col(0).setOnes();
  out.col(1) = value;
}

}  // namespace

template <int Dim>
ChanVese<Dim>::ChanVese(std::shared_ptr<const Field<Dim>> I, const ImageTotals& totals,
                        const ChanVeseOptions& options,
                        const std::optional<Antiderivative<Dim>>& antiderivative)
    : RegionEnergy<Dim>(std::move(I), one_and_value, 2,
                        {options.quadrature_order, options.ray_spacing_mm}),
      antiderivative_(antiderivative),
      totals_(totals),
      squared_scale_(options.intensity_scale * options.intensity_scale) {}

template <int Dim>
Eigen::VectorXd ChanVese<Dim>::integrals_over(const fem::Geometry<Dim>& shape) const {
  if (!antiderivative_) return RegionEnergy<Dim>::integrals_over(shape);
  const auto& rule = fem::quadrature<Dim>(kAntiderivativeOrder);
  Samples<Dim> samples;
  antiderivative_->P->sample(
      fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
      Derivatives::kNone, samples);
  double sum = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const double flux =
        shape.measures()[t] * shape.normals().row(t).dot(antiderivative_->direction);
    for (Eigen::Index q = 0; q < rule.size(); ++q)
      sum += flux * rule.weights[q] * samples.value[t * rule.size() + q];
  }
  return Eigen::Vector2d(shape.enclosed(), sum);
}

template <int Dim>
Eigen::VectorXd ChanVese<Dim>::change_between(const fem::Geometry<Dim>& from,
                                              const fem::Geometry<Dim>& to) const {
  if (!antiderivative_) return RegionEnergy<Dim>::change_between(from, to);
  return integrals_over(to) - integrals_over(from);
}

template <int Dim>
std::array<double, 2> ChanVese<Dim>::means() const {
  const Eigen::VectorXd& inside = this->integrals();
  return {inside[1] / inside[0], (totals_.intensity - inside[1]) / (totals_.content - inside[0])};
}

template <int Dim>
double ChanVese<Dim>::value_of(const Eigen::VectorXd& inside) const {
  const double outside_content = totals_.content - inside[0];
  const double outside_intensity = totals_.intensity - inside[1];
  const double J = totals_.intensity_squared - inside[1] * inside[1] / inside[0] -
                   outside_intensity * outside_intensity / outside_content;
  return J / squared_scale_;
}

template <int Dim>
std::function<std::array<double, 2>(double)> ChanVese<Dim>::density() const {
  const auto [mu_1, mu_2] = means();
  return [scale = 1 / squared_scale_, mu_1 = mu_1, mu_2 = mu_2](double I) {
    const double a = I - mu_1, b = I - mu_2;
    return std::array<double, 2>{scale * (a * a - b * b), scale * 2 * (a - b)};
  };
}

template <int Dim>
Eigen::MatrixXd ChanVese<Dim>::second_of_integrals() const {
  const auto [mu_1, mu_2] = means();
  const double a = 1 / this->integrals()[0], b = 1 / (totals_.content - this->integrals()[0]);
  const double mixed = mu_1 * a + mu_2 * b;
  Eigen::Matrix2d D2J;  // with respect to V_1 and S_1
  D2J << -(mu_1 * mu_1 * a + mu_2 * mu_2 * b), mixed, mixed, -(a + b);
  return 2 / squared_scale_ * D2J;
}

template class ChanVese<2>;
template class ChanVese<3>;

}  // namespace surf::energy
