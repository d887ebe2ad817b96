// Where a person has clicked.
#pragma once

#include <array>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::segment {

enum class Side { kInside, kOutside };

/// A point that belongs to the object, or does not; or a stroke of many that mean the same.
template <int Dim>
struct Click {
  Vector<Dim> point_mm;  ///< RAS mm, or mm of an image's plane
  Side side = Side::kInside;
  std::vector<Vector<Dim>> stroke_mm = {};  ///< further points of a stroke; none = a point

  bool operator==(const Click&) const = default;
};

/// Two opposite corners [world mm] of a box along the axes of the image: the centres of its first
/// and last cells.
template <int Dim>
using BoxCorners = std::array<Vector<Dim>, 2>;

}  // namespace surf::segment
