#include "libsurf/segment/model.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/fields.h"

namespace surf::segment {
namespace {

const std::map<std::string, std::set<std::string>>& known_parameters() {
  static const std::map<std::string, std::set<std::string>> known = {
      {"minimal-surface", {"gamma0", "gamma", "lambda"}},
      {"chan-vese", {}},
      {"window", {"mean", "half-width"}},
      {"area", {}}};
  return known;
}

double parameter(const EnergyTerm& term, const std::string& key) {
  const auto at = term.parameters.find(key);
  if (at == term.parameters.end())
    throw UsageError(fmt::format("energy {}: parameter {} is missing", term.name, key));
  return at->second;
}

/// Sums over the whole volume: one pass over the voxels, needed by the outer mean only.
energy::ImageTotals image_totals(const volume::Volume& volume) {
  const auto& size = volume.size();
  std::vector<float> slice(std::size_t(size[0]) * size[1]);
  double sum = 0, squares = 0;
  for (int k = 0; k < size[2]; ++k) {
    volume.copy_box({0, 0, k}, {size[0], size[1], k + 1}, slice.data());
    for (const float value : slice) {
      sum += value;
      squares += double(value) * value;
    }
  }
  const double voxel = std::pow(volume.voxel_size(), 3);
  return {voxel * double(volume.n_voxels()), voxel * sum, voxel * squares};
}

}  // namespace

void check_terms(std::span<const EnergyTerm> terms) {
  for (const EnergyTerm& term : terms) {
    const auto known = known_parameters().find(term.name);
    if (known == known_parameters().end())
      throw UsageError(fmt::format(
          "energy '{}' is unknown; there are minimal-surface, chan-vese, window and area",
          term.name));
    if (!std::isfinite(term.weight))
      throw UsageError(fmt::format("energy {}: weight {} is not a number", term.name, term.weight));
    for (const auto& [key, value] : term.parameters) {
      if (!known->second.contains(key))
        throw UsageError(fmt::format("energy {}: parameter '{}' is unknown", term.name, key));
      if (!std::isfinite(value))
        throw UsageError(fmt::format("energy {}: {} = {} is not a number", term.name, key, value));
      if ((key == "lambda" || key == "half-width") && !(value > 0))
        throw UsageError(fmt::format("energy {}: {} = {} violates > 0", term.name, key, value));
    }
  }
}

mesh::VolumeBox volume_box(const volume::Volume& volume) {
  return {volume.world_to_index(), volume.index_to_world(), volume.size()};
}

ImageModel::ImageModel(const volume::Volume& volume, const volume::SmoothingOptions& smoothing,
                       volume::DerivativeFilter filter)
    : volume_(volume),
      smoothing_(smoothing),
      filter_(filter),
      intensity_(volume::intensity_field(volume, smoothing)) {}

std::shared_ptr<const Field<3>> ImageModel::edge_indicator(double lambda) {
  auto& field = edge_indicators_[lambda];
  if (!field) field = volume::edge_indicator(volume_, smoothing_, lambda, filter_);
  return field;
}

energy::DomainIntegralOptions ImageModel::domain_options() const {
  return {.quadrature_order = 2, .ray_spacing_mm = volume_.voxel_size()};
}

std::shared_ptr<const Field<3>> ImageModel::window(const EnergyTerm& term) const {
  return energy::mapped_field<3>(
      intensity_, energy::intensity_window(parameter(term, "mean"), parameter(term, "half-width")));
}

std::vector<std::shared_ptr<const Field<3>>> ImageModel::integrands(
    std::span<const EnergyTerm> terms) {
  std::vector<std::shared_ptr<const Field<3>>> out;
  for (const EnergyTerm& term : terms) {
    if (term.name == "minimal-surface") out.push_back(edge_indicator(parameter(term, "lambda")));
    if (term.name == "window") out.push_back(window(term));
  }
  return out;
}

std::unique_ptr<energy::EnergySum<3>> ImageModel::energy(std::span<const EnergyTerm> terms) {
  check_terms(terms);
  auto sum = std::make_unique<energy::EnergySum<3>>();
  for (const EnergyTerm& term : terms) {
    if (term.name == "minimal-surface") {
      energy::add_minimal_surface<3>(*sum, edge_indicator(parameter(term, "lambda")),
                                     term.weight * parameter(term, "gamma0"),
                                     term.weight * parameter(term, "gamma"), domain_options());
    } else if (term.name == "chan-vese") {
      const energy::ImageTotals totals = image_totals(volume_);
      const double mean = totals.intensity / totals.content;
      const double variance = totals.intensity_squared / totals.content - mean * mean;
      energy::ChanVeseOptions options;
      options.ray_spacing_mm = volume_.voxel_size();
      options.intensity_scale = std::sqrt(std::max(variance, 1e-300));
      sum->add(term.weight, std::make_unique<energy::ChanVese<3>>(intensity_, totals, options));
    } else if (term.name == "window") {
      sum->add(term.weight,
               std::make_unique<energy::DomainIntegral<3>>(window(term), domain_options()));
    } else {
      sum->add(term.weight,
               std::make_unique<energy::BoundaryIntegral<3>>(energy::constant_field<3>(1)));
    }
  }
  return sum;
}

}  // namespace surf::segment
