// Curves in an image; private to libcurve/segment/*.cpp and its tests.
#pragma once

#include "libcurve/image/image.h"
#include "libsurf/segment/setting.h"

namespace surf::curve {

class CurveSetting : public segment::Setting<2> {
 public:
  explicit CurveSetting(const Image& image);

  const segment::ImageExtent<2>& extent() const override { return extent_; }
  std::vector<float> values(const std::array<int, 2>& lower,
                            const std::array<int, 2>& upper) const override;
  std::unique_ptr<segment::EnergyModel<2>> make_model(
      const volume::FieldOptions& options) const override;
  std::unique_ptr<mesh::MovingMesh<2>> make_shape(
      const Segments& start, const mesh::MovingShapeOptions<2>& options) const override;
  Segments ball(const Vector<2>& center, double radius, double edge_length) const override;
  Segments joined(const std::vector<Segments>& parts) const override;
  Segments flipped(const Segments& shape) const override;
  std::vector<std::uint8_t> rasterized(const Segments& shape, const std::array<int, 2>& size,
                                       const Eigen::Affine2d& index_to_world) const override;
  Segments shape_of_level(std::span<const float> values, const std::array<int, 2>& size,
                          const Eigen::Affine2d& index_to_world, double level) const override;
  std::function<double(const Vector<2>&)> distance_to(const Segments& shape) const override;
  bool is_embedded(const Segments& shape) const override;
  Segments moved(const Segments& shape, const Points<2>& to) const override;
  segment::Filtered<2> filtered(const Segments& shape, const segment::ComponentOptions& options,
                                const std::vector<Vector<2>>& seeds_mm) const override;
  bool do_overlap(const Segments& first, const Segments& second) const override;
  mesh::Parted<2> parted(const Segments& shape, const Segments& other,
                         const mesh::PartOptions<2>& options) const override;
  segment::Measures<2> measures(const Segments& shape) const override;
  Segments rounded_to_file(const Segments& shape, const std::string& extension) const override;
  Segments in_file_order(const Segments& shape) const override;
  const char* noun() const override { return "curve"; }

 private:
  std::string hash_content() const override;

  Image image_;
  Image scanned_;  ///< without its padding: all that is looked at
  segment::ImageExtent<2> extent_;
};

}  // namespace surf::curve
