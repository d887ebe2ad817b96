// What of an image was scanned, where it has been padded with a constant.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "libsurf/base/index_box.h"

namespace surf {

/// The box of what lies within frames of one value, as resampling and padding make them; the whole
/// image where there is none. A frame ends along one layer, where the image begins with many
/// values: of the lines across it that are not of its value alone half or more end there, and
/// half of these or more with values of their own. So a background that round objects stand in
/// is no frame, nor is that of a phantom without noise.
/// @param size    2 or more along each axis
/// @param values  (lower, upper): of a box lower <= index < upper, first index fastest
template <int Dim>
IndexBox<Dim> box_within_padding(
    const std::array<int, Dim>& size,
    const std::function<std::vector<float>(const std::array<int, Dim>&,
                                           const std::array<int, Dim>&)>& values);

}  // namespace surf
