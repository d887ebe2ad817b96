#include "libsurf/energy/energy_sum.h"

#include "libsurf/energy/boundary_integral.h"

namespace surf::energy {

template <int Dim>
void EnergySum<Dim>::add(double weight, std::unique_ptr<ShapeEnergy<Dim>> energy) {
  if (weight != 0) terms_.push_back({weight, std::move(energy)});
}

template <int Dim>
std::string EnergySum<Dim>::name() const {
  std::string names;
  for (const Term& term : terms_) names += (names.empty() ? "" : " + ") + term.energy->name();
  return names;
}

template <int Dim>
void EnergySum<Dim>::reset(const fem::Geometry<Dim>& shape) {
  for (Term& term : terms_) term.energy->reset(shape);
}

template <int Dim>
double EnergySum<Dim>::value() const {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.energy->value();
  return sum;
}

template <int Dim>
double EnergySum<Dim>::drift() const {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.energy->drift();
  return sum;
}

template <int Dim>
double EnergySum<Dim>::try_move(const fem::Geometry<Dim>& moved) {
  double sum = 0;
  for (Term& term : terms_) sum += term.weight * term.energy->try_move(moved);
  return sum;
}

template <int Dim>
void EnergySum<Dim>::accept() {
  for (Term& term : terms_) term.energy->accept();
}

template <int Dim>
void EnergySum<Dim>::remesh(const fem::Geometry<Dim>& shape) {
  for (Term& term : terms_) term.energy->remesh(shape);
}

template <int Dim>
void EnergySum<Dim>::rebuild(const fem::Geometry<Dim>& shape) {
  for (const Term& term : terms_) term.energy->rebuild(shape);
}

template <int Dim>
void EnergySum<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                   ShapeTerms<Dim>& terms) const {
  for (const Term& term : terms_)
    term.energy->differentiate(curvature, weight * term.weight, terms);
}

template <int Dim>
void EnergySum<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                         SecondDerivative<Dim>& second) const {
  for (const Term& term : terms_)
    term.energy->differentiate_twice(curvature, weight * term.weight, second);
}

template <int Dim>
void EnergySum<Dim>::add_density(const Points<Dim>& points, double weight,
                                 Eigen::VectorXd& density) const {
  for (const Term& term : terms_) term.energy->add_density(points, weight * term.weight, density);
}

template <int Dim>
void add_minimal_surface(EnergySum<Dim>& sum, std::shared_ptr<const Field<Dim>> H, double gamma_0,
                         double gamma, const DomainIntegralOptions& options) {
  sum.add(gamma_0, std::make_unique<BoundaryIntegral<Dim>>(H, options.quadrature_order));
  sum.add(gamma, std::make_unique<DomainIntegral<Dim>>(H, options));
}

template class EnergySum<2>;
template class EnergySum<3>;
template void add_minimal_surface<2>(EnergySum<2>&, std::shared_ptr<const Field<2>>, double, double,
                                     const DomainIntegralOptions&);
template void add_minimal_surface<3>(EnergySum<3>&, std::shared_ptr<const Field<3>>, double, double,
                                     const DomainIntegralOptions&);

}  // namespace surf::energy
