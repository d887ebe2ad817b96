// Surfaces in a volume; private to segment/*.cpp and its tests.
#pragma once

#include "libsurf/segment/setting.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

class SurfaceSetting : public Setting<3> {
 public:
  /// All that is computed from the volume is computed from it in RAS order: the order in which a
  /// file has its axes is an accident.
  explicit SurfaceSetting(const volume::Volume& volume);

  const ImageExtent<3>& extent() const override { return extent_; }
  std::vector<float> values(const std::array<int, 3>& lower,
                            const std::array<int, 3>& upper) const override;
  std::unique_ptr<EnergyModel<3>> make_model(const FieldOptions& options) const override;
  std::shared_ptr<const Field<3>> rough_intensity(const FieldOptions& options) const override;
  std::unique_ptr<mesh::MovingMesh<3>> make_shape(
      const Triangles& start, const mesh::MovingShapeOptions<3>& options) const override;
  Triangles ball(const Vector<3>& center, double radius, double edge_length) const override;
  Triangles joined(const std::vector<Triangles>& parts) const override;
  Triangles flipped(const Triangles& shape) const override;
  std::vector<std::uint8_t> rasterized(const Triangles& shape, const std::array<int, 3>& size,
                                       const Eigen::Affine3d& index_to_world) const override;
  Triangles shape_of_level(std::span<const float> values, const std::array<int, 3>& size,
                           const Eigen::Affine3d& index_to_world, double level) const override;
  std::function<double(const Vector<3>&)> distance_to(const Triangles& shape) const override;
  bool is_embedded(const Triangles& shape) const override;
  Triangles moved(const Triangles& shape, const Points<3>& to) const override;
  Filtered<3> filtered(const Triangles& shape, const ComponentOptions& options,
                       const std::vector<Vector<3>>& seeds_mm) const override;
  bool do_overlap(const Triangles& first, const Triangles& second) const override;
  mesh::Parted<3> parted(const Triangles& shape, const Triangles& other,
                         const mesh::PartOptions<3>& options) const override;
  Measures<3> measures(const Triangles& shape) const override;
  Triangles rounded_to_file(const Triangles& shape, const std::string& extension) const override;
  /// Points in the order in which triangles use them, and none besides.
  Triangles in_file_order(const Triangles& shape) const override;
  const char* noun() const override { return "surface"; }

 private:
  std::string hash_content() const override;

  volume::Volume volume_;
  volume::Volume scanned_;  ///< without its padding: all that is looked at
  ImageExtent<3> extent_;
};

}  // namespace surf::segment
