// Where a person has clicked.
#pragma once

#include <array>

#include "libsurf/base/types.h"

namespace surf::segment {

enum class Side { kInside, kOutside };

/// A point that belongs to the object, or does not.
template <int Dim>
struct Click {
  Vector<Dim> point_mm;  ///< RAS mm, or mm of an image's plane
  Side side = Side::kInside;
};

/// Two opposite corners [world mm] of a box along the axes of the image: the centres of its first
/// and last cells.
template <int Dim>
using BoxCorners = std::array<Vector<Dim>, 2>;

}  // namespace surf::segment
