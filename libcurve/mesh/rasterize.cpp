#include "libcurve/mesh/rasterize.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libcurve/mesh/detail/exact_segments.h"

namespace surf::curve {

std::vector<std::uint8_t> rasterize(const Segments& curves, const std::array<int, 2>& size,
                                    const Eigen::Affine2d& index_to_world) {
  check_elements(curves.points, curves.elements);
  const Eigen::Affine2d world_to_index = index_to_world.inverse();
  Points<2> points(curves.points.rows(), 2);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    points.row(i) = world_to_index * curves.points.row(i).transpose();
  std::vector<std::vector<std::pair<double, int>>> crossings(size[1]);  // of rows: i, sign
  for (const auto e : curves.elements.rowwise()) {
    // From the lower to the upper end, so that both elements at a node see it alike.
    const bool is_upwards = points(e[0], 1) < points(e[1], 1);
    const auto low = points.row(e[is_upwards ? 0 : 1]), high = points.row(e[is_upwards ? 1 : 0]);
    const double first = std::max(0.0, std::ceil(low[1]));
    const double last = std::min(double(size[1]) - 1, high[1]);
    if (!(first <= last)) continue;  // no int may hold it
    for (int j = int(first); j <= last && j < high[1]; ++j) {
      const double share = (j - low[1]) / (high[1] - low[1]);
      crossings[j].emplace_back(low[0] + share * (high[0] - low[0]), is_upwards ? 1 : -1);
    }
  }
  std::vector<std::uint8_t> out(std::size_t(size[0]) * size[1], 0);
  for (int j = 0; j < size[1]; ++j) {
    std::sort(crossings[j].begin(), crossings[j].end());
    int winding = 0;
    for (std::size_t k = 0; k + 1 < crossings[j].size(); ++k) {
      winding += crossings[j][k].second;
      if (winding == 0) continue;
      const auto column = [&](double x) { return std::clamp(std::ceil(x), 0.0, double(size[0])); };
      const double begin = column(crossings[j][k].first), end = column(crossings[j][k + 1].first);
      for (int i = int(begin); i < end; ++i) out[std::size_t(j) * size[0] + i] = 1;
    }
  }
  return out;
}

}  // namespace surf::curve
