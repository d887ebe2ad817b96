// Curves in an image, or surfaces in a volume: what the stages of a segmentation need of either.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "libsurf/mesh/moving_mesh.h"
#include "libsurf/mesh/parted.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/measures.h"
#include "libsurf/segment/options.h"

namespace surf::segment {

using volume::FieldOptions;

/// What stays of a shape, and what went.
template <int Dim>
struct Filtered {
  Simplices<Dim> shape;
  std::vector<Removed<Dim>> removed;
};

/// One image or volume and the shapes in it. Thread-safe.
template <int Dim>
class Setting {
 public:
  virtual ~Setting() = default;
  virtual const ImageExtent<Dim>& extent() const = 0;
  /// The values as they were read of the cells lower <= index < upper, first index fastest.
  /// @pre  the image has all of them
  virtual std::vector<float> values(const std::array<int, Dim>& lower,
                                    const std::array<int, Dim>& upper) const = 0;
  virtual std::unique_ptr<EnergyModel<Dim>> make_model(const FieldOptions& options) const = 0;
  /// Smoothed intensities for the search, which need not be as exact as those of a model.
  virtual std::shared_ptr<const Field<Dim>> rough_intensity(const FieldOptions& options) const {
    return make_model(options)->intensity();
  }
  virtual std::unique_ptr<mesh::MovingMesh<Dim>> make_shape(
      const Simplices<Dim>& start, const mesh::MovingShapeOptions<Dim>& options) const = 0;

  virtual Simplices<Dim> ball(const Vector<Dim>& center, double radius,
                              double edge_length) const = 0;
  virtual Simplices<Dim> joined(const std::vector<Simplices<Dim>>& parts) const = 0;
  virtual Simplices<Dim> flipped(const Simplices<Dim>& shape) const = 0;
  /// 1 for the cells of a grid inside the shape, first index fastest.
  virtual std::vector<std::uint8_t> rasterized(
      const Simplices<Dim>& shape, const std::array<int, Dim>& size,
      const Eigen::Transform<double, Dim, Eigen::Affine>& index_to_world) const = 0;
  /// Where the values at the nodes of a grid are `level`, larger ones inside; nothing if it is
  /// nowhere. See mesh::surface_of_level.
  virtual Simplices<Dim> shape_of_level(
      std::span<const float> values, const std::array<int, Dim>& size,
      const Eigen::Transform<double, Dim, Eigen::Affine>& index_to_world, double level) const = 0;
  /// Unsigned distance to a shape that is not empty [mm].
  virtual std::function<double(const Vector<Dim>&)> distance_to(
      const Simplices<Dim>& shape) const = 0;
  virtual bool is_embedded(const Simplices<Dim>& shape) const = 0;
  /// The shape moved to `to`, but for what would then intersect; ways that would make triangles
  /// thin are shortened.
  virtual Simplices<Dim> moved(const Simplices<Dim>& shape, const Points<Dim>& to) const = 0;
  /// Phantoms go, and what the options rule out.
  virtual Filtered<Dim> filtered(const Simplices<Dim>& shape, const ComponentOptions& options,
                                 const std::vector<Vector<Dim>>& seeds_mm) const = 0;
  /// Whether two shapes have an inner point in common, or touch; exact.
  virtual bool do_overlap(const Simplices<Dim>& first, const Simplices<Dim>& second) const = 0;
  /// What of a shape is left beside another one, see mesh::parted() and curve::parted().
  virtual mesh::Parted<Dim> parted(const Simplices<Dim>& shape, const Simplices<Dim>& other,
                                   const mesh::PartOptions<Dim>& options) const = 0;
  /// The final check, and what is worth knowing of a shape.
  virtual Measures<Dim> measures(const Simplices<Dim>& shape) const = 0;
  /// Rounded to the numbers of a file of this kind, such as ".stl"; as it is for "".
  virtual Simplices<Dim> rounded_to_file(const Simplices<Dim>& shape,
                                         const std::string& extension) const = 0;
  /// As files that hold doubles give it back: a start that was written and read again is the same
  /// to the bit.
  virtual Simplices<Dim> in_file_order(const Simplices<Dim>& shape) const = 0;
  /// SHA-1 of size, affine and values, in hexadecimal digits: the image that a recipe belongs to.
  /// Computed once.
  const std::string& content_hash() const {
    std::call_once(is_hashed_, [this] { hash_ = hash_content(); });
    return hash_;
  }
  /// "curve" or "surface"
  virtual const char* noun() const = 0;

 private:
  virtual std::string hash_content() const = 0;

  mutable std::once_flag is_hashed_;
  mutable std::string hash_;
};

}  // namespace surf::segment
