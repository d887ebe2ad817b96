// The energies of one volume; private to segment/*.cpp.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "libsurf/base/index_box.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/volume/image_fields.h"

namespace surf::segment {

/// Copies boxes of it, which must outlive what comes back.
inline auto reader_of(const volume::Volume& volume) {
  return [&volume](const std::array<int, 3>& lower, const std::array<int, 3>& upper) {
    std::vector<float> out(IndexBox<3>::between(lower, upper).n());
    volume.copy_box(lower, upper, out.data());
    return out;
  };
}

ImageExtent<3> extent_of(const volume::Volume& volume);

class ImageModel : public EnergyModel<3> {
 public:
  /// @param extent  extent_of(volume)
  ImageModel(const volume::Volume& volume, const ImageExtent<3>& extent,
             const volume::SmoothingOptions& smoothing, volume::DerivativeFilter filter);

  const volume::Volume& volume() const { return volume_; }
  std::shared_ptr<const Field<3>> intensity() const override { return intensity_; }
  /// Where there are at most kMostIntegrated nodes, since whole rows of them are kept.
  std::optional<energy::Antiderivative<3>> antiderivative() const override;
  /// Of the two classes of voxels.
  double contrast(const SeedModel& seed) const override;
  std::size_t memory_bytes() const override;
  std::unique_ptr<energy::ShapeEnergy<3>> mumford_shah(
      const PiecewiseSmooth& parameters) const override;

 protected:
  std::shared_ptr<const Field<3>> make_edge_indicator(double lambda) const override;
  energy::ImageTotals sum_up() const override;

 private:
  static constexpr double kMostIntegrated = 1 << 24;

  volume::Volume volume_;
  volume::SmoothedVolume smoothed_;
  volume::DerivativeFilter filter_;
  std::shared_ptr<const volume::TiledField> intensity_;
  mutable std::vector<std::shared_ptr<const volume::TiledField>> edge_indicators_;
  mutable std::shared_ptr<const volume::SplineIntegral> integral_;  // null until it is asked for
};

}  // namespace surf::segment
