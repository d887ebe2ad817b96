// Energies by name for one volume; private to segment/*.cpp.
#pragma once

#include <memory>
#include <span>

#include "libsurf/energy/energy_sum.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/segment/segment.h"

namespace surf::segment {

/// The fields of one volume and the energies made from them. Fields are shared by all energies.
class ImageModel {
 public:
  ImageModel(const volume::Volume& volume, const volume::SmoothingOptions& smoothing,
             volume::DerivativeFilter filter);

  const volume::Volume& volume() const { return volume_; }
  std::shared_ptr<const Field<3>> intensity() const { return intensity_; }
  std::shared_ptr<const Field<3>> edge_indicator(double lambda);

  /// The fields that are integrated over the surface, or whose integral over the domain it bounds,
  /// dimensionless and of order 1: what its resolution has to follow. Those of chan-vese, whose
  /// means change with every step, are not among them. Not thread-safe.
  std::vector<std::shared_ptr<const Field<3>>> integrands(std::span<const EnergyTerm> terms);
  /// @param terms  every parameter filled in
  std::unique_ptr<energy::EnergySum<3>> energy(std::span<const EnergyTerm> terms);

 private:
  energy::DomainIntegralOptions domain_options() const;
  std::shared_ptr<const Field<3>> window(const EnergyTerm& term) const;

  volume::Volume volume_;
  volume::SmoothingOptions smoothing_;
  volume::DerivativeFilter filter_;
  std::shared_ptr<const volume::TiledField> intensity_;
  std::map<double, std::shared_ptr<const volume::TiledField>> edge_indicators_;
};

/// Where a surface in the volume may move.
mesh::VolumeBox volume_box(const volume::Volume& volume);

/// @throws UsageError  an energy or parameter is unknown or out of its range
void check_terms(std::span<const EnergyTerm> terms);

}  // namespace surf::segment
