// How far the numbers of a file are apart. Private to segment/finish*.cpp.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>

#include "libsurf/base/types.h"

namespace surf::segment {

/// Between float32 numbers as large as the largest coordinate [mm].
/// @pre  some coordinate is not 0
template <int Dim>
double float_step(const Points<Dim>& points) {
  return std::exp2(std::floor(std::log2(points.cwiseAbs().maxCoeff())) + 1 -
                   std::numeric_limits<float>::digits);
}

/// The end of what is said of a shape that is broken by rounding to floats alone.
inline std::string float_step_text(double step_mm) {
  return fmt::format("; the file's floats are {:.2g} mm apart here, .vtp keeps doubles", step_mm);
}

}  // namespace surf::segment
