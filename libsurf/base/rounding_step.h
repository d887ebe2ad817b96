// What the values of an image have been rounded to.
#pragma once

#include <cstddef>
#include <span>

namespace surf {

/// The step q of which all values are whole multiples apart, if slopes have been rounded to it:
/// half or more of the neighbours in rows that are one step apart are followed or preceded by
/// another difference of the same sign within 4 values. 0 if there is no such step, as of floats
/// (but for one of their last digits), or if neighbours that are a step apart are edges, as in
/// masks and maps of labels. Scales with the values.
/// @param values    rows one after the other, each of row_size neighbours
double rounding_step(std::span<const float> values, std::size_t row_size);

}  // namespace surf
