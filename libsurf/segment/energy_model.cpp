#include "libsurf/segment/energy_model.h"

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/energy/anisotropic_integral.h"
#include "libsurf/energy/boundary_functional.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/content.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/region_statistics.h"

namespace surf::segment {
namespace {

constexpr double kAlignmentSmoothing = 0.1;    // of |s| at 0, in units of the scale
constexpr double kThirdDerivativeStep = 0.01;  // cells

}  // namespace

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
    if (term.parameters.contains("lambda"))
      out.push_back(edge_indicator(parameter(term, "lambda")));
    if (term.name == "window") out.push_back(window(term));
  }
  return out;
}

/// One pass over the cells; the totals of the image itself have the variance that the smoothing
/// takes off.
template <int Dim>
energy::ImageTotals EnergyModel<Dim>::field_totals() const {
  const int n = extent_.size[0];
  long n_rows = 1;
  for (int axis = 1; axis < Dim; ++axis) n_rows *= extent_.size[axis];
  const double cell = std::pow(extent_.cell_mm(), Dim);
  energy::ImageTotals totals;
  Points<Dim> points(n, Dim);
  Samples<Dim> samples;
  for (long row = 0; row < n_rows; ++row) {
    Vector<Dim> index = Vector<Dim>::Zero();
    long rest = row;
    for (int axis = 1; axis < Dim; ++axis, rest /= extent_.size[axis - 1])
      index[axis] = double(rest % extent_.size[axis]);
    for (int i = 0; i < n; ++i) {
      index[0] = i;
      points.row(i) = extent_.index_to_world * index;
    }
    intensity()->sample(points, Derivatives::kNone, samples);
    totals.content += cell * n;
    totals.intensity += cell * samples.value.sum();
    totals.intensity_squared += cell * samples.value.squaredNorm();
  }
  return totals;
}

template <int Dim>
std::unique_ptr<energy::ShapeEnergy<Dim>> EnergyModel<Dim>::chan_vese() const {
  const energy::ImageTotals all = totals();
  const double mean = all.intensity / all.content;
  const double variance = all.intensity_squared / all.content - mean * mean;
  energy::ChanVeseOptions options;
  options.ray_spacing_mm = extent_.cell_mm();
  options.intensity_scale = std::sqrt(std::max(variance, 1e-300));
  return std::make_unique<energy::ChanVese<Dim>>(intensity(), all, options, antiderivative());
}

template <int Dim>
energy::DensityPointer<Dim> EnergyModel<Dim>::norm(const EnergyTerm& term) {
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  if (Dim == 2 && term.parameters.contains("z"))
    throw UsageError("energy anisotropic: z: an image has the axes x and y only");
  Vector<Dim> squares;
  for (int axis = 0; axis < Dim; ++axis) squares[axis] = std::pow(parameter(term, kAxes[axis]), 2);
  const auto H = term.parameters.contains("lambda") ? edge_indicator(parameter(term, "lambda"))
                                                    : energy::constant_field<Dim>(1);
  return energy::norm_density<Dim>(H, squares.asDiagonal());
}

template <int Dim>
energy::DensityPointer<Dim> EnergyModel<Dim>::alignment(const EnergyTerm& term) const {
  const double sign = parameter(term, "sign"), scale = parameter(term, "scale");
  return energy::alignment_density<Dim>(intensity(),
                                        sign == 0
                                            ? energy::absolute_alignment(scale, kAlignmentSmoothing)
                                            : energy::signed_alignment(sign, scale),
                                        kThirdDerivativeStep * extent_.cell_mm());
}

template <int Dim>
std::unique_ptr<energy::ShapeEnergy<Dim>> EnergyModel<Dim>::make_energy(const EnergyTerm& term) {
  const auto edge = [&] { return edge_indicator(parameter(term, "lambda")); };
  const auto one = energy::constant_field<Dim>(1);
  const std::string& name = term.name;
  if (name == "minimal-surface") {
    auto sum = std::make_unique<energy::EnergySum<Dim>>();
    energy::add_minimal_surface<Dim>(*sum, edge(), parameter(term, "gamma0"),
                                     parameter(term, "gamma"), domain_options());
    return sum;
  }
  if (name == "chan-vese") return chan_vese();
  if (name == "mumford-shah") return make_mumford_shah(term);
  if (name == "window")
    return std::make_unique<energy::DomainIntegral<Dim>>(window(term), domain_options());
  if (name == "volume") return std::make_unique<energy::Content<Dim>>();
  if (name == "anisotropic") return std::make_unique<energy::AnisotropicIntegral<Dim>>(norm(term));
  if (name == "alignment")
    return std::make_unique<energy::AnisotropicIntegral<Dim>>(alignment(term));
  if (name == "willmore" || name == "prescribed-curvature")
    return std::make_unique<energy::CurvatureIntegral<Dim>>(energy::squared_curvature<Dim>(
        name == "willmore" ? one : edge(), parameter(term, "curvature")));
  if (name == "average-edge")
    return std::make_unique<energy::BoundaryFunctional<Dim>>(
        energy::average<Dim>(energy::isotropic_density<Dim>(edge())));
  if (name == "average-alignment")
    return std::make_unique<energy::BoundaryFunctional<Dim>>(energy::average<Dim>(alignment(term)));
  if (name == "region-competition")
    return std::make_unique<energy::RegionStatistics<Dim>>(
        name, intensity(), energy::region_competition(field_totals()),
        energy::StatisticsOptions{.ray_spacing_mm = extent_.cell_mm()});
  return std::make_unique<energy::BoundaryIntegral<Dim>>(one);
}

template <int Dim>
std::unique_ptr<energy::EnergySum<Dim>> EnergyModel<Dim>::energy(
    std::span<const EnergyTerm> terms) {
  check_terms(terms);
  auto sum = std::make_unique<energy::EnergySum<Dim>>();
  for (const EnergyTerm& term : terms) sum->add(term.weight, make_energy(term));
  return sum;
}

template class EnergyModel<2>;
template class EnergyModel<3>;

}  // namespace surf::segment
