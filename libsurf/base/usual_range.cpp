#include "libsurf/base/usual_range.h"

#include <algorithm>

namespace surf {
namespace {

constexpr double kShare = 1e-3;  // of the values, beyond either quantile
constexpr double kBeyond = 4;    // distances of the quantiles: metal in a CT is within

}  // namespace

std::array<float, 2> usual_range(const std::array<float, 2>& range, std::vector<float> samples) {
  const auto quantile = [&](double share) {
    const auto at = samples.begin() + std::ptrdiff_t(share * double(samples.size() - 1));
    std::nth_element(samples.begin(), at, samples.end());
    return double(*at);
  };
  const double low = quantile(kShare), high = quantile(1 - kShare);
  if (!(low < high)) return range;
  return {std::max(range[0], float(low - kBeyond * (high - low))),
          std::min(range[1], float(high + kBeyond * (high - low)))};
}

}  // namespace surf
