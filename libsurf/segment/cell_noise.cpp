#include "libsurf/segment/cell_noise.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace surf::segment {
namespace {

constexpr int kLag = 2;           // cells: noise is alike no further
constexpr int kBlock = kLag + 1;  // cells
constexpr double kAlike = 2;      // correlation; phantoms have 1.2 or less, scans 15 to 25
constexpr std::size_t kMostLagged = 20000;

}  // namespace

template <int Dim>
double noise_correlation(const std::vector<EdgeCell<Dim>>& cells,
                         const std::vector<double>& residuals, const std::array<int, Dim>& size) {
  std::unordered_map<std::uint64_t, std::size_t> at;
  for (std::size_t k = 0; k < cells.size(); ++k) at.emplace(cells[k].index, k);
  const auto clipped = [&](std::size_t k) { return std::clamp(residuals[k], -4.0, 4.0); };
  double variance = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) variance += clipped(k) * clipped(k);
  variance /= std::max<double>(residuals.size(), 1);
  const std::size_t stride = 1 + cells.size() / kMostLagged;
  std::array<int, Dim> lag;
  lag.fill(-kLag);
  double sum = 0;
  while (true) {
    std::int64_t step = 0, scale = 1;
    bool is_zero = true;
    for (int axis = 0; axis < Dim; ++axis) {
      step += lag[axis] * scale;
      scale *= size[axis];
      is_zero &= lag[axis] == 0;
    }
    double product = 0, n = 0;
    if (!is_zero && step > 0)
      for (std::size_t k = 0; k < cells.size(); k += stride)
        if (const auto other = at.find(cells[k].index + std::uint64_t(step)); other != at.end()) {
          product += clipped(k) * clipped(other->second);
          ++n;
        }
    if (n > 0) sum += 2 * product / n / std::max(variance, 1e-300);
    int axis = 0;
    while (axis < Dim && ++lag[axis] > kLag) lag[axis++] = -kLag;
    if (axis == Dim) break;
  }
  return std::max(1.0, 1 + sum);
}

template <int Dim>
bool is_in_first_half(std::uint64_t index, const std::array<int, Dim>& size, double correlation) {
  const std::uint64_t side = correlation < kAlike ? 1 : kBlock;
  std::uint64_t block = 0, scale = 1;
  for (int axis = 0; axis < Dim; ++axis) {
    const auto n = std::uint64_t(size[axis]);
    block += index % n / side * scale;
    index /= n;
    scale *= n;
  }
  // The finaliser of splitmix64.
  block = (block ^ (block >> 30)) * 0xbf58476d1ce4e5b9u;
  block = (block ^ (block >> 27)) * 0x94d049bb133111ebu;
  return (block ^ (block >> 31)) & 1;
}

#define SURF_INSTANTIATE(Dim)                                                                      \
  template double noise_correlation<Dim>(const std::vector<EdgeCell<Dim>>&,                        \
                                         const std::vector<double>&, const std::array<int, Dim>&); \
  template bool is_in_first_half<Dim>(std::uint64_t, const std::array<int, Dim>&, double);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
