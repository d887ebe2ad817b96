// A scalar image in the plane.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surf::curve {

/// Where an image came from; for `curveseg info` and reports. Nothing computes with it.
struct ImageSource {
  std::string path;
  std::string format;              ///< "PNG", "NIfTI-1, axial slice 120", ...
  std::string scalar_type;         ///< type in the file: "uint8", ...
  std::string spacing_source;      ///< what gave the spacing: "file", "options", "unknown", ...
  std::vector<std::string> notes;  ///< what a user should know: colors, further pages, ...
};

/// Scalar values at pixel centres, index (i, j) with the column i fastest and row 0 on top, and the
/// affine map from pixel centre to the plane in millimetres; any invertible one is legal. An image
/// whose pixel size is unknown has pixels of 1 mm. A slice of a volume also knows its place in the
/// world.
///
/// Immutable and cheap to copy (the values are shared); reading is thread-safe.
class Image {
 public:
  /// @param plane_to_ras  (x, y, distance from the plane) [mm] to RAS mm, an isometry
  /// @param thickness_mm  of the slice; 0 = unknown
  /// @throws InputError  a size < 2, more pixels than memory can hold, another number of values,
  ///                     NaN or Inf, a singular, non-finite or non-affine matrix
  Image(const std::array<int, 2>& size, const Eigen::Affine2d& pixel_to_plane,
        std::vector<float> values, ImageSource source = {},
        const std::optional<Eigen::Affine3d>& plane_to_ras = {}, double thickness_mm = 0);

  const std::array<int, 2>& size() const { return data_->size; }
  std::size_t n_pixels() const { return data_->values.size(); }
  const Eigen::Affine2d& pixel_to_plane() const { return data_->pixel_to_plane; }
  const Eigen::Affine2d& plane_to_pixel() const { return data_->plane_to_pixel; }
  const std::optional<Eigen::Affine3d>& plane_to_ras() const { return data_->plane_to_ras; }
  /// What a slice stands for to both sides of its plane together [mm]; 0 = unknown.
  double thickness_mm() const { return data_->thickness_mm; }
  /// Lengths of the affine's columns [mm].
  Eigen::Vector2d spacing() const { return pixel_to_plane().linear().colwise().norm(); }
  /// Square root of the pixel's area [mm]: the "px" of lengths.
  double pixel_size() const;
  const ImageSource& source() const { return data_->source; }
  /// Smallest and largest value.
  std::array<float, 2> range() const { return data_->range; }

  /// Values, i fastest.
  const std::vector<float>& values() const { return data_->values; }
  float value(int i, int j) const { return values()[std::size_t(j) * size()[0] + i]; }
  /// Whether a point of the plane lies in one of the pixels.
  bool contains(const Eigen::Vector2d& point_mm) const;

 private:
  struct Data {
    std::array<int, 2> size;
    Eigen::Affine2d pixel_to_plane, plane_to_pixel;
    std::optional<Eigen::Affine3d> plane_to_ras;
    double thickness_mm;
    std::vector<float> values;
    std::array<float, 2> range;
    ImageSource source;
  };
  std::shared_ptr<const Data> data_;
};

/// Pixel (0, 0) at the plane's origin, columns along x, rows along y.
Eigen::Affine2d pixel_to_plane(const Eigen::Vector2d& spacing_mm);

/// @throws InputError  a size < 2, or more pixels than memory can hold
void check_image_size(const std::array<long long, 2>& size, const std::string& path);

}  // namespace surf::curve
