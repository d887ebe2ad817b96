#include "libsurf/segment/rung_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace surf::segment {

double RungFeatures::score() const {
  return separation * edge_share * std::sqrt(std::clamp(sphericity, 0.0, 1.0)) * growth_out *
         std::exp(-growth_in / 4);
}

double histogram_separation(std::span<const float> inside, std::span<const float> outside) {
  constexpr int kBins = 32;
  if (inside.empty() || outside.empty()) return 0;
  std::vector<float> all(inside.begin(), inside.end());
  all.insert(all.end(), outside.begin(), outside.end());
  const auto ranked = [&](std::size_t rank) {
    std::nth_element(all.begin(), all.begin() + std::ptrdiff_t(rank), all.end());
    return double(all[rank]);
  };
  const std::size_t tail = all.size() / 100;
  const double low = ranked(tail), high = ranked(all.size() - 1 - tail);
  if (!(high > low)) return 0;
  const auto histogram = [&](std::span<const float> values) {
    std::array<double, kBins> bins{};
    for (const double value : values)
      bins[std::clamp(int(kBins * (value - low) / (high - low)), 0, kBins - 1)] +=
          1.0 / double(values.size());
    return bins;
  };
  const auto p = histogram(inside), q = histogram(outside);
  double overlap = 0;
  for (int bin = 0; bin < kBins; ++bin) overlap += std::min(p[bin], q[bin]);
  return std::max(0.0, 1 - overlap);  // rounding
}

}  // namespace surf::segment
