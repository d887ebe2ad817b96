// Where an image or a volume lies.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "libsurf/base/types.h"

namespace surf {

/// The part of the plane that the pixel centres of an image span (Dim = 2), or of space those of a
/// volume's voxels (Dim = 3): 0 <= index <= size - 1.
template <int Dim>
struct ImageBox {
  using Affine = Eigen::Transform<double, Dim, Eigen::Affine>;
  using Index = Eigen::Array<double, Dim, 1>;

  std::array<int, Dim> size;
  Affine index_to_world, world_to_index;

  Index first() const { return Index::Zero(); }
  Index last() const {
    return Eigen::Map<const Eigen::Array<int, Dim, 1>>(size.data()).template cast<double>() - 1;
  }
  bool contains(const Vector<Dim>& point_mm) const {
    const Index index = (world_to_index * point_mm).array();
    return (index >= first()).all() && (index <= last()).all();
  }
  /// The point itself if the box contains it, else each index of it as far as the box goes.
  Vector<Dim> clamped(const Vector<Dim>& point_mm) const {
    const Index index = (world_to_index * point_mm).array();
    const Index inside = index.max(first()).min(last());
    if ((inside == index).all()) return point_mm;
    return index_to_world * Vector<Dim>(inside.matrix());
  }
};

}  // namespace surf
