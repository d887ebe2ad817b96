// Where an image or a volume lies.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "libsurf/base/types.h"

namespace surf {

/// The part of the plane that the pixels of an image fill (Dim = 2), or of space that the voxels of
/// a volume do (Dim = 3), to their outer faces: -0.5 <= index <= size - 0.5.
template <int Dim>
struct ImageBox {
  using Affine = Eigen::Transform<double, Dim, Eigen::Affine>;
  using Index = Eigen::Array<double, Dim, 1>;
  static constexpr double kNear = 1e-6;  ///< cells: a point as near to a face lies on it

  std::array<int, Dim> size;
  Affine index_to_world, world_to_index;

  Index first() const { return Index::Constant(-0.5); }
  Index last() const {
    return Eigen::Map<const Eigen::Array<int, Dim, 1>>(size.data()).template cast<double>() - 0.5;
  }
  Index index(const Vector<Dim>& point_mm) const { return (world_to_index * point_mm).array(); }

  bool contains(const Vector<Dim>& point_mm) const {
    const Index at = index(point_mm);
    return (at >= first()).all() && (at <= last()).all();
  }
  /// Whether it lies outside, and on no face.
  bool is_beyond(const Vector<Dim>& point_mm) const {
    const Index at = index(point_mm);
    return (at < first() - kNear).any() || (at > last() + kNear).any();
  }
  /// The faces that a point lies on, to 1e-6 of a cell, one bit each: those with the first and with
  /// the last index along each axis.
  std::uint8_t faces(const Vector<Dim>& point_mm) const {
    const Index at = index(point_mm);
    std::uint8_t out = 0;
    for (int axis = 0; axis < Dim; ++axis) {
      if (at[axis] <= first()[axis] + kNear) out |= 1 << (2 * axis);
      if (at[axis] >= last()[axis] - kNear) out |= 2 << (2 * axis);
    }
    return out;
  }
  /// Outward unit normals of the faces, in the order of their bits.
  Points<Dim> normals() const {
    Points<Dim> out(2 * Dim, Dim);
    for (int axis = 0; axis < Dim; ++axis) {
      out.row(2 * axis + 1) = world_to_index.linear().row(axis).normalized();
      out.row(2 * axis) = -out.row(2 * axis + 1);
    }
    return out;
  }
  /// The point itself if the box contains it and it lies on these faces, else each index of it as
  /// far as the box goes, on the faces.
  Vector<Dim> clamped(const Vector<Dim>& point_mm, std::uint8_t on_faces = 0) const {
    const Index at = index(point_mm);
    Index inside = at.max(first()).min(last());
    for (int axis = 0; axis < Dim; ++axis)
      if (on_faces >> (2 * axis) & 3)
        inside[axis] = on_faces >> (2 * axis) & 1 ? first()[axis] : last()[axis];
    if ((inside == at).all()) return point_mm;
    return index_to_world * Vector<Dim>(inside.matrix());
  }
  /// Length or area of the faces [mm^(Dim-1)].
  double border_measure() const {
    Eigen::Matrix<double, Dim, Dim> sides = index_to_world.linear();
    for (int axis = 0; axis < Dim; ++axis) sides.col(axis) *= size[axis];
    // Content over the distance of two faces: 1 / |row of the inverse|.
    return 2 * std::abs(sides.determinant()) * sides.inverse().rowwise().norm().sum();
  }
};

}  // namespace surf
