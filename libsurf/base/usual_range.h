// Where the values of an image lie but for a few far away.
#pragma once

#include <array>
#include <vector>

namespace surf {

/// From the lowest to the highest value, but no further from the quantiles 0.001 and 0.999 than
/// four times the distance of these: a voxel of metal, or one that is broken, is not what an image
/// is measured by. Where these quantiles are one value it is the whole range.
/// @param range    lowest and highest value of all
/// @param samples  some of them, at least one
std::array<float, 2> usual_range(const std::array<float, 2>& range, std::vector<float> samples);

}  // namespace surf
