// Points in messages; private to segment.
#pragma once

#include <fmt/format.h>

#include <string>

#include "libsurf/base/types.h"

namespace surf::segment {

/// "12, -30.5, 44"
template <int Dim>
std::string point_text(const Vector<Dim>& point) {
  std::string out;
  for (const double x : point) out += fmt::format("{}{:g}", out.empty() ? "" : ", ", x);
  return out;
}

}  // namespace surf::segment
