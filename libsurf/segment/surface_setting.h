// Surfaces in a volume; private to segment/*.cpp and its tests.
#pragma once

#include "libsurf/segment/run.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

class SurfaceSetting : public Setting<3> {
 public:
  SurfaceSetting(const volume::Volume& volume, volume::DerivativeFilter filter);

  const ImageExtent<3>& extent() const override { return extent_; }
  std::unique_ptr<EnergyModel<3>> make_model(
      const volume::SmoothingOptions& smoothing) const override;
  std::unique_ptr<GrowingShape<3>> make_shape(const Triangles& start,
                                              const ShapeOptions<3>& options) const override;
  Triangles ball(const Vector<3>& center, double radius, double edge_length) const override;
  Triangles joined(const std::vector<Triangles>& parts) const override;
  Triangles flipped(const Triangles& shape) const override;
  std::vector<std::uint8_t> rasterized(const Triangles& shape, const std::array<int, 3>& size,
                                       const Eigen::Affine3d& index_to_world) const override;
  Triangles shape_of_level(std::span<const float> values, const std::array<int, 3>& size,
                           const Eigen::Affine3d& index_to_world, double level) const override;
  bool is_embedded(const Triangles& shape) const override;
  Triangles moved(const Triangles& shape, const Points<3>& to) const override;
  const char* noun() const override { return "surface"; }

 private:
  volume::Volume volume_;
  volume::DerivativeFilter filter_;
  ImageExtent<3> extent_;
};

}  // namespace surf::segment
