#include "libsurf/base/rounding_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace surf {
namespace {

constexpr double kSlack = 1e-2;      // of a step: what a scaled value is off by
constexpr std::ptrdiff_t kNear = 4;  // values
constexpr double kOnSlopes = 0.5;    // of the differences of one step

/// The least difference of two of them that is more than a float's last digits; 0 if they are all
/// the same or some are no multiple of it apart.
double common_step(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t n = 1; n < values.size(); ++n)
    step = std::min(step, double(values[n]) - values[n - 1]);
  if (!std::isfinite(step)) return 0;
  for (const float value : values) {
    const double steps = (double(value) - values.front()) / step;
    if (std::abs(steps - std::round(steps)) > kSlack) return 0;
  }
  return step;
}

}  // namespace

double rounding_step(std::span<const float> values, std::size_t row_size) {
  const double step = common_step({values.begin(), values.end()});
  if (step == 0) return 0;
  std::size_t n_of_one_step = 0, n_on_slopes = 0;
  const auto n_differences = std::ptrdiff_t(row_size) - 1;
  for (std::size_t row = 0; row + row_size <= values.size(); row += row_size) {
    const auto difference = [&](std::ptrdiff_t i) {
      return double(values[row + std::size_t(i) + 1]) - values[row + std::size_t(i)];
    };
    for (std::ptrdiff_t i = 0; i < n_differences; ++i) {
      const double here = difference(i);
      if (here == 0 || std::abs(here) > 1.5 * step) continue;
      ++n_of_one_step;
      bool is_on_slope = false;
      for (std::ptrdiff_t at = std::max<std::ptrdiff_t>(0, i - kNear);
           at <= std::min(n_differences - 1, i + kNear); ++at)
        is_on_slope |= at != i && difference(at) * here > 0;
      n_on_slopes += is_on_slope;
    }
  }
  return double(n_on_slopes) >= kOnSlopes * double(n_of_one_step) && n_of_one_step > 0 ? step : 0;
}

}  // namespace surf
