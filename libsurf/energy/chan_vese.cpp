#include "libsurf/energy/chan_vese.h"

#include <algorithm>

#include "libsurf/energy/detail/region_terms.h"
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
    : I_(std::move(I)),
      antiderivative_(antiderivative),
      totals_(totals),
      options_(options),
      integrals_(options.quadrature_order, options.ray_spacing_mm, 2) {}

template <int Dim>
void ChanVese<Dim>::reset(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  inside_ = integrals_over(shape);
}

template <int Dim>
Eigen::VectorXd ChanVese<Dim>::integrals_over(const fem::Geometry<Dim>& shape) const {
  if (!antiderivative_) return integrals_.absolute(*I_, one_and_value, shape);
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
double ChanVese<Dim>::try_move(const fem::Geometry<Dim>& moved) {
  tried_ = std::make_unique<fem::Geometry<Dim>>(moved);
  tried_inside_ = inside_ + integrals_.swept(*I_, one_and_value, *shape_, moved);
  return value_of(tried_inside_);
}

template <int Dim>
void ChanVese<Dim>::accept() {
  shape_ = std::move(tried_);
  inside_ = tried_inside_;
}

template <int Dim>
void ChanVese<Dim>::remesh(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
}

template <int Dim>
std::array<double, 2> ChanVese<Dim>::means() const {
  return {inside_[1] / inside_[0],
          (totals_.intensity - inside_[1]) / (totals_.content - inside_[0])};
}

template <int Dim>
double ChanVese<Dim>::value_of(const Eigen::VectorXd& inside) const {
  const double outside_content = totals_.content - inside[0];
  const double outside_intensity = totals_.intensity - inside[1];
  const double J = totals_.intensity_squared - inside[1] * inside[1] / inside[0] -
                   outside_intensity * outside_intensity / outside_content;
  return J / (options_.intensity_scale * options_.intensity_scale);
}

template <int Dim>
void ChanVese<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                  ShapeTerms<Dim>& terms) const {
  add_region_terms<Dim>(*I_, *shape_, options_.quadrature_order, curvature.mean, weight, density(),
                        terms);
}

template <int Dim>
void ChanVese<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                        SecondDerivative<Dim>& second) const {
  add_region_second<Dim>(*I_, *shape_, options_.quadrature_order, curvature.mean, weight, density(),
                         second.sparse);
  const auto [mu_1, mu_2] = means();
  const double a = 1 / inside_[0], b = 1 / (totals_.content - inside_[0]);
  const double mixed = mu_1 * a + mu_2 * b;
  Eigen::Matrix2d D2J;  // with respect to V_1 and S_1
  D2J << -(mu_1 * mu_1 * a + mu_2 * mu_2 * b), mixed, mixed, -(a + b);
  const double scale = 2 * weight / (options_.intensity_scale * options_.intensity_scale);
  second.add_integrals(region_loads<Dim>(*I_, *shape_, options_.quadrature_order, one_and_value, 2),
                       scale * D2J);
}

template <int Dim>
typename ChanVese<Dim>::Density ChanVese<Dim>::density() const {
  const auto [mu_1, mu_2] = means();
  const double scale = 1 / (options_.intensity_scale * options_.intensity_scale);
  return [scale, mu_1 = mu_1, mu_2 = mu_2](double I) {
    const double a = I - mu_1, b = I - mu_2;
    return std::array<double, 2>{scale * (a * a - b * b), scale * 2 * (a - b)};
  };
}

template <int Dim>
void ChanVese<Dim>::add_density(const Points<Dim>& points, double weight,
                                Eigen::VectorXd& density) const {
  const auto [mu_1, mu_2] = means();
  const double scale = weight / (options_.intensity_scale * options_.intensity_scale);
  Samples<Dim> samples;
  I_->sample(points, Derivatives::kNone, samples);
  density.array() +=
      scale * ((samples.value.array() - mu_1).square() - (samples.value.array() - mu_2).square());
}

template class ChanVese<2>;
template class ChanVese<3>;

}  // namespace surf::energy
