#include "libsurf/mesh/detail/annulus.h"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace surf::mesh {

std::vector<std::array<int, 3>> annulus(const Points<3>& points, const std::vector<int>& first,
                                        const std::vector<int>& second) {
  std::vector<int> a = first, b(second.rbegin(), second.rend());  // side by side
  const auto squared = [&](int p, int q) { return (points.row(p) - points.row(q)).squaredNorm(); };
  double closest = std::numeric_limits<double>::infinity();
  std::size_t start_a = 0, start_b = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if (const double d = squared(a[i], b[j]); d < closest) closest = d, start_a = i, start_b = j;
  std::rotate(a.begin(), a.begin() + start_a, a.end());
  std::rotate(b.begin(), b.begin() + start_b, b.end());
  a.push_back(a.front());
  b.push_back(b.front());

  // cost(i, j): of the best strip up to the edge between a[i] and b[j].
  const std::size_t n = a.size(), m = b.size();
  std::vector<double> cost(m, std::numeric_limits<double>::infinity());
  std::vector<std::uint8_t> is_from_a(n * m, 0);  // the last triangle stands on a side of a
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      const double above = i > 0 ? cost[j] : std::numeric_limits<double>::infinity();
      const double beside = j > 0 ? cost[j - 1] : std::numeric_limits<double>::infinity();
      is_from_a[i * m + j] = above <= beside;
      cost[j] = (i + j == 0 ? 0 : std::min(above, beside)) + squared(a[i], b[j]);
    }
  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(n + m);
  for (std::size_t i = n - 1, j = m - 1; i + j > 0;) {
    if (j == 0 || (i > 0 && is_from_a[i * m + j])) {
      triangles.push_back({a[i - 1], a[i], b[j]});
      --i;
    } else {
      triangles.push_back({b[j], b[j - 1], a[i]});
      --j;
    }
  }
  std::reverse(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace surf::mesh
