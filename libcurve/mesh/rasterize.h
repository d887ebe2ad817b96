// Label masks of curves on any affine pixel grid.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// 1 for every pixel whose centre lies inside the curves, 0 for the others; i fastest.
///
/// Inside is a non-zero winding number. A centre on a curve is inside where the domain lies
/// towards growing i. Crossings with rows of pixels are half-open, so that every row is entered as
/// often as left; exact up to rounding of their coordinates. Curves may reach out of the grid.
/// O(elements + crossings + pixels).
///
/// @param size            pixels along i, j
/// @param index_to_world  pixel centre (i, j) to mm; invertible
std::vector<std::uint8_t> rasterize(const Segments& curves, const std::array<int, 2>& size,
                                    const Eigen::Affine2d& index_to_world);

}  // namespace surf::curve
