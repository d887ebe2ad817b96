// The energies of one volume; private to segment/*.cpp.
#pragma once

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

 protected:
  std::shared_ptr<const Field<3>> make_edge_indicator(double lambda) const override;
  energy::ImageTotals totals() const override;
  std::unique_ptr<energy::ShapeEnergy<3>> make_mumford_shah(const EnergyTerm& term) const override;

 private:
  volume::Volume volume_;
  volume::SmoothingOptions smoothing_;
  volume::DerivativeFilter filter_;
  std::shared_ptr<const volume::TiledField> intensity_;
};

ImageExtent<3> extent_of(const volume::Volume& volume);

}  // namespace surf::segment
