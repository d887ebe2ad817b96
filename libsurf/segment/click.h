// Where a person has clicked.
#pragma once

#include "libsurf/base/types.h"

namespace surf::segment {

enum class Side { kInside, kOutside };

/// A point that belongs to the object, or does not.
template <int Dim>
struct Click {
  Vector<Dim> point_mm;  ///< RAS mm, or mm of an image's plane
  Side side = Side::kInside;
};

}  // namespace surf::segment
