// How far object and background are apart in intensity.
#pragma once

#include <span>

namespace surf::segment {

/// Distance of the two means that explain most of the variance of the values when these are split
/// at a threshold (Otsu), > 0: noise widens it far less than the range. 1 if all values are equal.
double two_class_contrast(std::span<const float> values);

}  // namespace surf::segment
