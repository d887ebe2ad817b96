#include "libsurf/segment/rung_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace surf::segment {
namespace {

constexpr int kBins = 32;

}  // namespace

double RungFeatures::score() const {
  return separation * edge_share * std::sqrt(std::clamp(sphericity, 0.0, 1.0)) * growth_out *
         std::exp(-growth_in / 4);
}

double histogram_separation(std::span<const float> inside, std::span<const float> outside) {
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

double histogram_separation(std::span<const int> inside, std::span<const int> outside) {
  const double n_inside = std::accumulate(inside.begin(), inside.end(), 0.0),
               n_outside = std::accumulate(outside.begin(), outside.end(), 0.0);
  if (n_inside == 0 || n_outside == 0) return 0;
  const double tail = std::floor((n_inside + n_outside) / 100);
  const auto ranked = [&](bool from_top) {
    const int last = int(inside.size()) - 1;
    int level = 0;
    for (double n = 0; level < last; ++level) {
      const int at = from_top ? last - level : level;
      n += inside[at] + outside[at];
      if (n > tail) break;
    }
    return from_top ? last - level : level;
  };
  const int low = ranked(false), high = ranked(true);
  if (!(high > low)) return 0;
  std::array<double, kBins> p{}, q{};
  for (int level = 0; level < int(inside.size()); ++level) {
    const int bin = std::clamp(kBins * (level - low) / (high - low), 0, kBins - 1);
    p[bin] += inside[level];
    q[bin] += outside[level];
  }
  double overlap = 0;
  for (int bin = 0; bin < kBins; ++bin) overlap += std::min(p[bin] / n_inside, q[bin] / n_outside);
  return std::max(0.0, 1 - overlap);  // rounding
}

}  // namespace surf::segment
