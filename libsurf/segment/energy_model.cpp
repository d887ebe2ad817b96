#include "libsurf/segment/energy_model.h"

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/fields.h"

namespace surf::segment {

template <int Dim>
std::shared_ptr<const Field<Dim>> EnergyModel<Dim>::edge_indicator(double lambda) {
  auto& field = edge_indicators_[lambda];
  if (!field) field = make_edge_indicator(lambda);
  return field;
}

template <int Dim>
double EnergyModel<Dim>::contrast() const {
  const double width = double(extent_.range[1]) - extent_.range[0];
  return width > 0 ? width : 1;
}

template <int Dim>
std::unique_ptr<energy::ShapeEnergy<Dim>> EnergyModel<Dim>::make_mumford_shah(
    const EnergyTerm&) const {
  throw UsageError("energy mumford-shah: not available for this kind of image");
}

template <int Dim>
energy::DomainIntegralOptions EnergyModel<Dim>::domain_options() const {
  return {.quadrature_order = 2, .ray_spacing_mm = extent_.cell_mm()};
}

template <int Dim>
std::shared_ptr<const Field<Dim>> EnergyModel<Dim>::window(const EnergyTerm& term) const {
  return energy::mapped_field<Dim>(
      intensity(),
      energy::intensity_window(parameter(term, "mean"), parameter(term, "half-width")));
}

template <int Dim>
std::vector<std::shared_ptr<const Field<Dim>>> EnergyModel<Dim>::integrands(
    std::span<const EnergyTerm> terms) {
  std::vector<std::shared_ptr<const Field<Dim>>> out;
  for (const EnergyTerm& term : terms) {
    if (term.name == "minimal-surface") out.push_back(edge_indicator(parameter(term, "lambda")));
    if (term.name == "window") out.push_back(window(term));
  }
  return out;
}

template <int Dim>
std::unique_ptr<energy::EnergySum<Dim>> EnergyModel<Dim>::energy(
    std::span<const EnergyTerm> terms) {
  check_terms(terms);
  auto sum = std::make_unique<energy::EnergySum<Dim>>();
  for (const EnergyTerm& term : terms) {
    if (term.name == "minimal-surface") {
      energy::add_minimal_surface<Dim>(*sum, edge_indicator(parameter(term, "lambda")),
                                       term.weight * parameter(term, "gamma0"),
                                       term.weight * parameter(term, "gamma"), domain_options());
    } else if (term.name == "chan-vese") {
      const energy::ImageTotals all = totals();
      const double mean = all.intensity / all.content;
      const double variance = all.intensity_squared / all.content - mean * mean;
      energy::ChanVeseOptions options;
      options.ray_spacing_mm = extent_.cell_mm();
      options.intensity_scale = std::sqrt(std::max(variance, 1e-300));
      sum->add(term.weight, std::make_unique<energy::ChanVese<Dim>>(intensity(), all, options,
                                                                    antiderivative()));
    } else if (term.name == "mumford-shah") {
      sum->add(term.weight, make_mumford_shah(term));
    } else if (term.name == "window") {
      sum->add(term.weight,
               std::make_unique<energy::DomainIntegral<Dim>>(window(term), domain_options()));
    } else {
      sum->add(term.weight,
               std::make_unique<energy::BoundaryIntegral<Dim>>(energy::constant_field<Dim>(1)));
    }
  }
  return sum;
}

template class EnergyModel<2>;
template class EnergyModel<3>;

}  // namespace surf::segment
