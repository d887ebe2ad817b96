// How far object and background are apart in intensity.
#pragma once

#include <array>
#include <limits>
#include <span>

#include "libsurf/segment/seed_model.h"

namespace surf::segment {

/// Distance of the two means that explain most of the variance of the values when these are split
/// at a threshold (Otsu), > 0: noise widens it far less than the range. 1 if all values are equal.
/// @param usual  where nearly all values lie, see usual_range(): others count as the nearer end
double two_class_contrast(std::span<const float> values,
                          const std::array<float, 2>& usual = {std::numeric_limits<float>::lowest(),
                                                               std::numeric_limits<float>::max()});

/// `usual`, and the mean round the seeds, which belongs to an object however small that is.
std::array<float, 2> with_object(const std::array<float, 2>& usual, const SeedModel& seed);

}  // namespace surf::segment
