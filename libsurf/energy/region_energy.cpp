#include "libsurf/energy/region_energy.h"

#include "libsurf/energy/detail/region_terms.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {

template <int Dim>
RegionEnergy<Dim>::RegionEnergy(std::shared_ptr<const Field<Dim>> I, Integrands w, int n_integrals,
                                const DomainIntegralOptions& options)
    : I_(std::move(I)),
      w_(std::move(w)),
      n_integrals_(n_integrals),
      quadrature_order_(options.quadrature_order),
      counts_from_start_(options.counts_from_start),
      integrals_(options.quadrature_order, options.ray_spacing_mm, n_integrals) {}

template <int Dim>
Eigen::VectorXd RegionEnergy<Dim>::integrals_over(const fem::Geometry<Dim>& shape) const {
  return integrals_.absolute(*I_, w_, shape);
}

template <int Dim>
void RegionEnergy<Dim>::reset(const fem::Geometry<Dim>& shape) {
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  drift_ = 0;
  if (!counts_from_start_)
    p_ = integrals_over(shape);
  else if (p_.size() == 0)
    p_ = Eigen::VectorXd::Zero(n_integrals_);
}

template <int Dim>
double RegionEnergy<Dim>::try_move(const fem::Geometry<Dim>& moved) {
  tried_ = std::make_unique<fem::Geometry<Dim>>(moved);
  tried_p_ = p_ + integrals_.swept(*I_, w_, *shape_, moved);
  return value_of(tried_p_) - drift_;
}

template <int Dim>
void RegionEnergy<Dim>::accept() {
  shape_ = std::move(tried_);
  p_ = tried_p_;
}

template <int Dim>
Eigen::VectorXd RegionEnergy<Dim>::change_between(const fem::Geometry<Dim>& from,
                                                  const fem::Geometry<Dim>& to) const {
  Samples<Dim> samples;
  const auto& rule = fem::quadrature<Dim>(quadrature_order_);
  I_->sample(fem::quadrature_points<Dim>(to.points(), to.elements(), rule.points),
             Derivatives::kNone, samples);
  Eigen::MatrixXd values(samples.value.size(), n_integrals_);
  w_(samples.value, values);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n_integrals_);
  for (Eigen::Index t = 0; t < to.n_elements(); ++t)
    for (Eigen::Index q = 0; q < rule.size(); ++q)
      sum += to.measures()[t] * rule.weights[q] * values.row(t * rule.size() + q).transpose();
  return (to.enclosed() - from.enclosed()) / to.measure() * sum;
}

template <int Dim>
void RegionEnergy<Dim>::remesh(const fem::Geometry<Dim>& shape) {
  const bool is_linear = second_of_integrals().size() == 0;  // G does not depend on p
  if (!is_linear && !shape.is_part() && !shape_->is_part()) {
    const double before = value_of(p_);
    p_ += change_between(*shape_, shape);
    drift_ += value_of(p_) - before;
  }
  shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
}

template <int Dim>
void RegionEnergy<Dim>::rebuild(const fem::Geometry<Dim>& shape) {
  const double before = value();
  const bool is_same = shape.points().rows() == shape_->points().rows() &&
                       shape.elements().rows() == shape_->elements().rows() &&
                       shape.points() == shape_->points() && shape.elements() == shape_->elements();
  std::optional<Eigen::VectorXd> change;
  if (!is_same && !is_cheap_from_scratch() && !counts_from_start_ && !shape.is_part() &&
      !shape_->is_part())
    change = integrals_.between(*I_, w_, *shape_, shape);
  if (change) {
    p_ += *change;
    shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
  } else {
    reset(shape);
  }
  drift_ = value_of(p_) - before;
}

template <int Dim>
void RegionEnergy<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                      ShapeTerms<Dim>& terms) const {
  add_region_terms<Dim>(*I_, *shape_, quadrature_order_, curvature.mean, weight, density(), terms);
}

template <int Dim>
void RegionEnergy<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                            SecondDerivative<Dim>& second) const {
  add_region_second<Dim>(*I_, *shape_, quadrature_order_, curvature.mean, weight, density(),
                         second.sparse);
  const Eigen::MatrixXd of_integrals = second_of_integrals();
  if (of_integrals.size() == 0) return;
  second.add_integrals(region_loads<Dim>(*I_, *shape_, quadrature_order_, w_, n_integrals_),
                       weight * of_integrals);
}

template <int Dim>
void RegionEnergy<Dim>::add_density(const Points<Dim>& points, double weight,
                                    Eigen::VectorXd& out) const {
  const auto G = density();
  Samples<Dim> samples;
  I_->sample(points, Derivatives::kNone, samples);
  for (Eigen::Index i = 0; i < points.rows(); ++i) out[i] += weight * G(samples.value[i])[0];
}

template class RegionEnergy<2>;
template class RegionEnergy<3>;

}  // namespace surf::energy
