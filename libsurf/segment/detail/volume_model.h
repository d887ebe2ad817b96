// The energies of one volume; private to segment/*.cpp.
#pragma once

#include <vector>

#include "libsurf/segment/energy_model.h"
#include "libsurf/volume/image_fields.h"

namespace surf::segment {

class ImageModel : public EnergyModel<3> {
 public:
  ImageModel(const volume::Volume& volume, const volume::SmoothingOptions& smoothing,
             volume::DerivativeFilter filter);

  const volume::Volume& volume() const { return volume_; }
  std::shared_ptr<const Field<3>> intensity() const override { return intensity_; }
  /// Of the two classes of voxels.
  double contrast() const override;
  std::size_t memory_bytes() const override;
  std::unique_ptr<energy::ShapeEnergy<3>> mumford_shah(
      const PiecewiseSmooth& parameters) const override;

 protected:
  std::shared_ptr<const Field<3>> make_edge_indicator(double lambda) const override;
  energy::ImageTotals sum_up() const override;

 private:
  volume::Volume volume_;
  volume::SmoothedVolume smoothed_;
  volume::DerivativeFilter filter_;
  std::shared_ptr<const volume::TiledField> intensity_;
  mutable std::vector<std::shared_ptr<const volume::TiledField>> edge_indicators_;
};

ImageExtent<3> extent_of(const volume::Volume& volume);

}  // namespace surf::segment
