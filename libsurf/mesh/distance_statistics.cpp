#include "libsurf/mesh/distance_statistics.h"

#include <algorithm>
#include <cmath>

namespace surf::mesh {

DistanceStatistics distance_statistics(std::vector<double> at_samples,
                                       const std::vector<double>& at_vertices) {
  DistanceStatistics result;
  for (double& value : at_samples) {
    result.signed_mean_mm += value;
    value = std::abs(value);
    result.mean_mm += value;
    result.rms_mm += value * value;
    result.max_mm = std::max(result.max_mm, value);
  }
  const double n = double(at_samples.size());
  result.signed_mean_mm /= n;
  result.mean_mm /= n;
  result.rms_mm = std::sqrt(result.rms_mm / n);
  for (const double value : at_vertices) result.max_mm = std::max(result.max_mm, std::abs(value));
  const auto p95 = at_samples.begin() + static_cast<std::ptrdiff_t>(0.95 * (n - 1));
  std::nth_element(at_samples.begin(), p95, at_samples.end());
  result.p95_mm = *p95;
  return result;
}

SymmetricDistances symmetric_distances(const DistanceStatistics& forward, double first,
                                       const DistanceStatistics& backward, double second) {
  const double whole = first + second;
  const auto square = [](double x) { return x * x; };
  SymmetricDistances result{forward, backward};
  result.mean_mm = (first * forward.mean_mm + second * backward.mean_mm) / whole;
  result.rms_mm =
      std::sqrt((first * square(forward.rms_mm) + second * square(backward.rms_mm)) / whole);
  result.p95_mm = std::max(forward.p95_mm, backward.p95_mm);
  result.max_mm = std::max(forward.max_mm, backward.max_mm);
  return result;
}

}  // namespace surf::mesh
