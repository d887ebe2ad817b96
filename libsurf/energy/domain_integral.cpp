#include "libsurf/energy/domain_integral.h"

#include "libsurf/energy/detail/region_terms.h"

namespace surf::energy {
namespace {

void identity(const Eigen::VectorXd& value, Eigen::MatrixXd& out) { out.col(0) = value; }

}  // namespace

template <int Dim>
DomainIntegral<Dim>::DomainIntegral(std::shared_ptr<const Field<Dim>> F,
                                    const DomainIntegralOptions& options)
    : F_(std::move(F)),
      options_(options),
      integrals_(options.quadrature_order, options.ray_spacing_mm, 1) {}

template <int Dim>
void DomainIntegral<Dim>::reset(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  value_ = integrals_.absolute(*F_, identity, shape)[0];
}

template <int Dim>
double DomainIntegral<Dim>::try_move(const fem::Geometry<Dim>& moved) {
  tried_ = std::make_unique<fem::Geometry<Dim>>(moved);
  return tried_value_ = value_ + integrals_.swept(*F_, identity, *shape_, moved)[0];
}

template <int Dim>
void DomainIntegral<Dim>::accept() {
  shape_ = std::move(tried_);
  value_ = tried_value_;
}

template <int Dim>
void DomainIntegral<Dim>::remesh(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
}

template <int Dim>
void DomainIntegral<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                        ShapeTerms<Dim>& terms) const {
  add_region_terms<Dim>(
      *F_, *shape_, options_.quadrature_order, curvature.mean, weight,
      [](double value) {
        return std::array<double, 2>{value, 1};
      },
      terms);
}

template <int Dim>
void DomainIntegral<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                              SecondDerivative<Dim>& second) const {
  add_region_second<Dim>(
      *F_, *shape_, options_.quadrature_order, curvature.mean, weight,
      [](double value) {
        return std::array<double, 2>{value, 1};
      },
      second.sparse);
}

template <int Dim>
void DomainIntegral<Dim>::add_density(const Points<Dim>& points, double weight,
                                      Eigen::VectorXd& density) const {
  Samples<Dim> samples;
  F_->sample(points, Derivatives::kNone, samples);
  density += weight * samples.value;
}

template class DomainIntegral<2>;
template class DomainIntegral<3>;

}  // namespace surf::energy
