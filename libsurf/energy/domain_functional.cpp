#include "libsurf/energy/domain_functional.h"

#include "libsurf/energy/detail/region_terms.h"

namespace surf::energy {
namespace {

void identity(const Eigen::VectorXd& value, Eigen::MatrixXd& out) { out.col(0) = value; }

std::array<double, 2> identity_density(double value) { return {value, 1}; }

}  // namespace

template <int Dim>
DomainFunctional<Dim>::DomainFunctional(std::shared_ptr<const FieldFamily<Dim>> H,
                                        const DomainIntegralOptions& options)
    : H_(std::move(H)),
      options_(options),
      integrals_(options.quadrature_order, options.ray_spacing_mm, 1) {}

template <int Dim>
double DomainFunctional<Dim>::integral(const Pointer& field) const {
  return field ? integrals_.absolute(*field, identity, *shape_)[0] : 0;
}

template <int Dim>
double DomainFunctional<Dim>::swept(const Pointer& field, const fem::Geometry<Dim>& moved) const {
  return field ? integrals_.swept(*field, identity, *shape_, moved)[0] : 0;
}

template <int Dim>
void DomainFunctional<Dim>::reset(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  const auto& w = H_->integrands();
  p_.resize(w.size());
  for (std::size_t k = 0; k < w.size(); ++k) p_[k] = integral(w[k]);
  value_ = integral(H_->at(p_));
  base_ = value_;
  drift_ = 0;
}

/// What changes is H over the current domain, and the domain by what the boundary sweeps.
template <int Dim>
double DomainFunctional<Dim>::try_move(const fem::Geometry<Dim>& moved) {
  tried_ = std::make_unique<fem::Geometry<Dim>>(moved);
  tried_p_ = p_;
  const auto& w = H_->integrands();
  for (std::size_t k = 0; k < w.size(); ++k) tried_p_[k] += swept(w[k], moved);
  const Pointer H = H_->at(tried_p_);
  if (!base_) base_ = integral(H_->at(p_));
  return tried_value_ = value_ + (integral(H) - *base_) + swept(H, moved);
}

template <int Dim>
void DomainFunctional<Dim>::accept() {
  shape_ = std::move(tried_);
  p_ = tried_p_;
  value_ = tried_value_;
  base_.reset();
}

template <int Dim>
void DomainFunctional<Dim>::remesh(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  base_.reset();
}

/// What mending and surgery have changed goes into drift().
template <int Dim>
void DomainFunctional<Dim>::rebuild(const fem::Geometry<Dim>& shape) {
  const double before = value_;
  reset(shape);
  drift_ = value_ - before;
  value_ = before;
}

template <int Dim>
std::vector<std::pair<double, typename DomainFunctional<Dim>::Pointer>>
DomainFunctional<Dim>::gradient_fields() const {
  std::vector<std::pair<double, Pointer>> fields;
  if (const Pointer H = H_->at(p_)) fields.emplace_back(1, H);
  const auto& w = H_->integrands();
  for (std::size_t k = 0; k < w.size(); ++k)
    fields.emplace_back(integral(H_->first(p_, int(k))), w[k]);
  return fields;
}

template <int Dim>
void DomainFunctional<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                          ShapeTerms<Dim>& terms) const {
  for (const auto& [factor, field] : gradient_fields())
    add_region_terms<Dim>(*field, *shape_, options_.quadrature_order, curvature.mean,
                          weight * factor, identity_density, terms);
}

template <int Dim>
void DomainFunctional<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                                SecondDerivative<Dim>& second) const {
  for (const auto& [factor, field] : gradient_fields())
    add_region_second<Dim>(*field, *shape_, options_.quadrature_order, curvature.mean,
                           weight * factor, identity_density, second.sparse);
  const auto load = [&](const Pointer& field) -> Eigen::VectorXd {
    if (!field) return Eigen::VectorXd::Zero(shape_->n_vertices());
    return region_loads<Dim>(*field, *shape_, options_.quadrature_order, identity, 1);
  };
  const int n = static_cast<int>(p_.size());
  Eigen::MatrixXd vectors(shape_->n_vertices(), 2 * n);  // w_1 .. w_n, dH/dp_1 .. dH/dp_n
  Eigen::MatrixXd coefficients = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (int k = 0; k < n; ++k) {
    vectors.col(k) = load(H_->integrands()[k]);
    vectors.col(n + k) = load(H_->first(p_, k));
    coefficients(k, n + k) = coefficients(n + k, k) = weight;
    for (int l = 0; l < n; ++l) coefficients(k, l) = weight * integral(H_->second(p_, k, l));
  }
  second.add_integrals(vectors, coefficients);
}

template <int Dim>
void DomainFunctional<Dim>::add_density(const Points<Dim>& points, double weight,
                                        Eigen::VectorXd& density) const {
  Samples<Dim> samples;
  for (const auto& [factor, field] : gradient_fields()) {
    field->sample(points, Derivatives::kNone, samples);
    density += weight * factor * samples.value;
  }
}

template class DomainFunctional<2>;
template class DomainFunctional<3>;

}  // namespace surf::energy
