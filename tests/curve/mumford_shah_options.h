// The Mumford-Shah model that tests and studies share.
#pragma once

#include "libcurve/energy/mumford_shah.h"
#include "tests/curve/analytic_fields.h"

namespace surf::curve {

/// On the square of half side 2, meshes as fine as the pixels of side h.
inline MumfordShahOptions options_on_square(double h) {
  MumfordShahOptions out;
  out.mu = 0.1;
  out.gamma = 0.05;
  out.outer = square(2);
  out.pixel_mm = h;
  out.max_size_mm = 2 * h;
  out.data_tolerance = 0;
  return out;
}

}  // namespace surf::curve
