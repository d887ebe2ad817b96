#include "libsurf/segment/detail/cell_noise.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surf::segment {
namespace {

constexpr int kLag = 2;           // cells: noise is alike no further
constexpr int kBlock = kLag + 1;  // cells
constexpr double kAlike = 2;      // correlation; phantoms have 1.2 or less, scans 15 to 25
constexpr std::size_t kMostLagged = 20000;

/// From the index of a cell to those of the cells behind it that are no more than kLag apart.
template <int Dim>
std::vector<std::uint64_t> steps_to_neighbours(const std::array<int, Dim>& size) {
  std::vector<std::uint64_t> out;
  std::array<int, Dim> lag;
  lag.fill(-kLag);
  while (true) {
    std::int64_t step = 0, scale = 1;
    for (int axis = 0; axis < Dim; ++axis) {
      step += lag[axis] * scale;
      scale *= size[axis];
    }
    if (step > 0) out.push_back(std::uint64_t(step));
    int axis = 0;
    while (axis < Dim && ++lag[axis] > kLag) lag[axis++] = -kLag;
    if (axis == Dim) return out;
  }
}

/// The first place from `from` on with a value >= least, looked for in longer and longer strides
/// (one by one it was a sixth of locating the edges of a ball in 256^3).
std::size_t first_at_least(const std::vector<std::uint64_t>& ascending, std::size_t from,
                           std::uint64_t least) {
  std::size_t stride = 1;
  while (from + stride < ascending.size() && ascending[from + stride] < least) {
    from += stride;
    stride *= 2;
  }
  const auto end =
      ascending.begin() + std::ptrdiff_t(std::min(from + stride + 1, ascending.size()));
  return std::size_t(std::lower_bound(ascending.begin() + std::ptrdiff_t(from), end, least) -
                     ascending.begin());
}

}  // namespace

template <int Dim>
double noise_correlation(const EdgeCells<Dim>& cells, const std::vector<double>& residuals,
                         const std::array<int, Dim>& size) {
  std::vector<std::uint64_t> index(cells.size());
  std::vector<double> clipped(cells.size());
  double variance = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const std::size_t place = cells.by_index()[k];
    index[k] = cells[place].index;
    clipped[k] = std::clamp(residuals[place], -4.0, 4.0);
    variance += clipped[k] * clipped[k];
  }
  variance /= std::max<double>(double(cells.size()), 1);
  const std::vector<std::uint64_t> steps = steps_to_neighbours<Dim>(size);
  const std::size_t stride = 1 + cells.size() / kMostLagged;
  std::vector<double> covariances(steps.size(), 0);
  tbb::parallel_for(std::size_t(0), steps.size(), [&](std::size_t lag) {
    double product = 0, n = 0;
    for (std::size_t k = 0, other = 0; k < index.size(); k += stride) {
      other = first_at_least(index, other, index[k] + steps[lag]);
      if (other == index.size()) break;
      if (index[other] != index[k] + steps[lag]) continue;
      product += clipped[k] * clipped[other];
      ++n;
    }
    if (n > 0) covariances[lag] = product / n;
  });
  double sum = 0;
  for (const double covariance : covariances) sum += 2 * covariance / std::max(variance, 1e-300);
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

#define SURF_INSTANTIATE(Dim)                                                               \
  template double noise_correlation<Dim>(const EdgeCells<Dim>&, const std::vector<double>&, \
                                         const std::array<int, Dim>&);                      \
  template bool is_in_first_half<Dim>(std::uint64_t, const std::array<int, Dim>&, double);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
