#include "libcurve/mesh/detail/box_tree.h"

#include <cstdint>
#include <numeric>

namespace surf::curve {
namespace {

/// Bits of the two coordinates in turn: places near each other get numbers near each other.
std::uint64_t interleaved(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint64_t v) {
    v = (v | v << 16) & 0x0000ffff0000ffffull;
    v = (v | v << 8) & 0x00ff00ff00ff00ffull;
    v = (v | v << 4) & 0x0f0f0f0f0f0f0f0full;
    v = (v | v << 2) & 0x3333333333333333ull;
    return (v | v << 1) & 0x5555555555555555ull;
  };
  return spread(x) | spread(y) << 1;
}

/// First elements of the parts, sorted by their place.
void sort_by_place(const Points<2>& points, const Elements<2>& elements, std::vector<int>& parts) {
  const Eigen::RowVector2d lower = points.colwise().minCoeff(),
                           size = points.colwise().maxCoeff() - lower;
  const double scale = size.maxCoeff() > 0 ? 4294967295.0 / size.maxCoeff() : 0;
  std::vector<std::pair<std::uint64_t, int>> keyed;
  for (const int e : parts) {
    const Eigen::RowVector2d at = (points.row(elements(e, 0)) - lower) * scale;
    keyed.emplace_back(interleaved(std::uint32_t(at[0]), std::uint32_t(at[1])), e);
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t k = 0; k < parts.size(); ++k) parts[k] = keyed[k].second;
}

}  // namespace

std::vector<int> order_along_curves(const Points<2>& points, const Elements<2>& elements) {
  constexpr std::size_t kFew = 4;
  const int n = static_cast<int>(elements.rows());
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::size_t n_breaks = 0;
  for (int e = 1; e < n; ++e) n_breaks += elements(e, 0) != elements(e - 1, 1);
  if (n_breaks < kFew) return order;  // the common case, at half the cost of what follows
  order.clear();
  std::vector<int> starting(points.rows(), -1);
  for (int e = n - 1; e >= 0; --e) starting[elements(e, 0)] = e;
  std::vector<char> is_placed(n, 0);
  const auto follow = [&](int first, std::vector<int>* into) {
    for (int e = first; e >= 0 && !is_placed[e]; e = starting[elements(e, 1)]) {
      is_placed[e] = 1;
      into->push_back(e);
    }
  };
  std::vector<int> parts;
  for (int first = 0; first < n; ++first) {
    if (is_placed[first]) continue;
    parts.push_back(first);
    follow(first, &order);
  }
  if (parts.size() <= kFew) return order;
  sort_by_place(points, elements, parts);
  order.clear();
  is_placed.assign(n, 0);
  for (const int first : parts) follow(first, &order);
  // What an earlier part ran into in the first pass and now stands before it.
  for (int first = 0; first < n; ++first) follow(first, &order);
  return order;
}

}  // namespace surf::curve
