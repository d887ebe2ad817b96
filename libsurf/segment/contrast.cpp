#include "libsurf/segment/contrast.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace surf::segment {
namespace {

// Of the values, or so many: broken voxels, metal. More than that are an object, however small.
constexpr double kShareOfBroken = 1e-5;
constexpr double kMostBroken = 8;

/// `usual`, or the range of the values where too many of them lie beyond an end of it.
std::array<float, 2> ends(std::span<const float> values, const std::array<float, 2>& usual) {
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  const double most = std::max(kMostBroken, kShareOfBroken * double(values.size()));
  const auto n_below =
      std::count_if(values.begin(), values.end(), [&](float value) { return value < usual[0]; });
  const auto n_above =
      std::count_if(values.begin(), values.end(), [&](float value) { return value > usual[1]; });
  return {double(n_below) > most ? *lowest : std::max(usual[0], *lowest),
          double(n_above) > most ? *highest : std::min(usual[1], *highest)};
}

}  // namespace

double two_class_contrast(std::span<const float> values, const std::array<float, 2>& usual) {
  constexpr int kBins = 1024;
  if (values.empty()) return 1;
  const auto [lowest, highest] = ends(values, usual);
  const auto within = [lowest = lowest, highest = highest](float value) {
    return std::min(std::max(value, lowest), highest);
  };
  const double low = lowest, width = double(highest) - low;
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

}  // namespace surf::segment
