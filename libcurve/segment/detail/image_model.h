// The energies of one image; private to libcurve/segment/*.cpp.
#pragma once

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/image/image_fields.h"
#include "libsurf/segment/energy_model.h"

namespace surf::curve {

/// (5.4) on the image's pixels.
std::unique_ptr<MumfordShah> mumford_shah(const Image& image,
                                          std::shared_ptr<const Field<2>> intensity,
                                          const segment::PiecewiseSmooth& parameters);

class ImageModel : public segment::EnergyModel<2> {
 public:
  ImageModel(const Image& image, const segment::ImageExtent<2>& extent,
             const FieldOptions& options);

  std::shared_ptr<const Field<2>> intensity() const override { return intensity_; }
  /// Of the two classes of pixels.
  double contrast(const segment::SeedModel& seed) const override;
  std::size_t memory_bytes() const override;
  std::optional<energy::Antiderivative<2>> antiderivative() const override;
  std::unique_ptr<energy::ShapeEnergy<2>> mumford_shah(
      const segment::PiecewiseSmooth& parameters) const override;

 protected:
  std::shared_ptr<const Field<2>> make_edge_indicator(double lambda) const override;
  energy::ImageTotals sum_up() const override;

 private:
  Image image_;
  FieldOptions options_;
  std::shared_ptr<const Field<2>> intensity_;
  mutable int n_edge_indicators_ = 0;
};

}  // namespace surf::curve
