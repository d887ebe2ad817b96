// Which values of an image can be computed with.
#pragma once

#include <cmath>

namespace surf {

/// The square of a larger value is no float any more.
inline constexpr float kLargestValue = 1e18f;

inline bool is_usable_value(float value) { return std::abs(value) <= kLargestValue; }

/// What to say of a value that is not: "NaN; replace NaN and Inf first".
inline const char* fault_of_value(float value) {
  return std::isnan(value)   ? "NaN; replace NaN and Inf first"
         : std::isinf(value) ? "Inf; replace NaN and Inf first"
                             : "beyond 1e18, where floats overflow; rescale the values first";
}

}  // namespace surf
