// Curves in an image; private to libcurve/segment/segment.cpp and its tests.
#pragma once

#include "libcurve/image/image_fields.h"
#include "libsurf/segment/run.h"

namespace surf::curve {

class CurveSetting : public segment::Setting<2> {
 public:
  /// @param options  but for its smoothing
  CurveSetting(const Image& image, const FieldOptions& options);

  const segment::ImageExtent<2>& extent() const override { return extent_; }
  std::unique_ptr<segment::EnergyModel<2>> make_model(
      const volume::SmoothingOptions& smoothing) const override;
  std::unique_ptr<segment::GrowingShape<2>> make_shape(
      const Segments& start, const segment::ShapeOptions<2>& options) const override;
  Segments ball(const Vector<2>& center, double radius, double edge_length) const override;
  Segments joined(const std::vector<Segments>& parts) const override;
  Segments flipped(const Segments& shape) const override;
  std::vector<std::uint8_t> rasterized(const Segments& shape, const std::array<int, 2>& size,
                                       const Eigen::Affine2d& index_to_world) const override;
  Segments shape_of_level(std::span<const float> values, const std::array<int, 2>& size,
                          const Eigen::Affine2d& index_to_world, double level) const override;
  bool is_embedded(const Segments& shape) const override;
  Segments moved(const Segments& shape, const Points<2>& to) const override;
  const char* noun() const override { return "curve"; }

 private:
  Image image_;
  FieldOptions options_;
  segment::ImageExtent<2> extent_;
};

}  // namespace surf::curve
