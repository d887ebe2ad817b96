// Values of lines that are spread over an image: what tells their usual range.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "libsurf/base/index_box.h"

namespace surf::segment {

/// Of 32 lines along the first axis for each other one, or of all where there are fewer.
/// @param size    of the image
/// @param values  (lower, upper): of a box lower <= index < upper
template <int Dim, class Values>
std::vector<float> some_values(const typename IndexBox<Dim>::Index& size, const Values& values) {
  constexpr int kLinesAlongAxis = 32;
  typename IndexBox<Dim>::Index count;
  for (int axis = 0; axis < Dim; ++axis)
    count[axis] = axis == 0 ? 1 : std::min(size[axis], kLinesAlongAxis);
  const IndexBox<Dim> lines{{}, count};
  std::vector<float> out;
  for (std::size_t n = 0; n < lines.n(); ++n) {
    typename IndexBox<Dim>::Index first = lines.node(n), end;
    for (int axis = 1; axis < Dim; ++axis) {
      first[axis] = int((2L * first[axis] + 1) * size[axis] / (2L * count[axis]));
      end[axis] = first[axis] + 1;
    }
    end[0] = size[0];
    const std::vector<float> line = values(first, end);
    out.insert(out.end(), line.begin(), line.end());
  }
  return out;
}

}  // namespace surf::segment
