#include "libsurf/segment/contrast.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace surf::segment {

double two_class_contrast(std::span<const float> values, const std::array<float, 2>& usual) {
  constexpr int kBins = 1024;
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  if (lowest == values.end() || !(*highest > *lowest)) return 1;
  const auto within = [&](float value) { return std::min(std::max(value, usual[0]), usual[1]); };
  const double low = within(*lowest), width = double(within(*highest)) - low;
  if (!(width > 0)) return 1;
  std::vector<double> counts(kBins), sums(kBins);
  double sum = 0;
  for (const float each : values) {
    const float value = within(each);
    const int bin = std::min(kBins - 1, int((value - low) / width * kBins));
    counts[bin] += 1;
    sums[bin] += value - low;
    sum += value - low;
  }
  const double n = double(values.size());
  double n_below = 0, below = 0, best = -1, contrast = width;
  for (int bin = 0; bin + 1 < kBins; ++bin) {
    n_below += counts[bin];
    below += sums[bin];
    if (n_below == 0 || n_below == n) continue;
    const double distance = (sum - below) / (n - n_below) - below / n_below;
    const double between = n_below * (n - n_below) * distance * distance;
    if (between <= best) continue;
    best = between;
    contrast = distance;
  }
  return contrast;
}

std::array<float, 2> with_object(const std::array<float, 2>& usual, const SeedModel& seed) {
  if (!(seed.radius_mm > 0)) return usual;
  return {std::min(usual[0], float(seed.mean)), std::max(usual[1], float(seed.mean))};
}

}  // namespace surf::segment
