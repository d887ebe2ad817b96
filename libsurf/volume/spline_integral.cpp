#include "libsurf/volume/spline_integral.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libsurf/volume/detail/spline.h"
#include "libsurf/volume/detail/tile_store.h"

namespace surf::volume {
namespace {

constexpr int kCells = 16;          // cells per tile across the rows
constexpr int kNodes = kCells + 3;  // the cubic B-spline of a cell reaches from node -1 to 2
constexpr int kFirst = -3;          // the quartic one of the cell before node 0 begins there
constexpr int kBlock = 64;          // points per task

/// Of B4(t + 3/2), ..., B4(t - 5/2).
std::array<double, 5> quartic_weights(double t) {
  const auto power = [](double x) { return x * x * x * x; };
  const auto beside = [&](double x) {  // 1/2 to 3/2 from the middle
    return (55 + 20 * x - 120 * x * x + 80 * x * x * x - 16 * power(x)) / 96;
  };
  const double x = t - 0.5;
  return {power(1 - t) / 24, beside(t + 0.5), 115.0 / 192 - 0.625 * x * x + power(x) / 4,
          beside(1.5 - t), power(t) / 24};
}

}  // namespace

struct SplineIntegral::Impl {
  Impl(const Grid& grid, NodalValues values)
      : size(grid.size),
        world_to_index(grid.index_to_world.inverse()),
        nodal_values(std::move(values)),
        length(size[0] + 2 - kFirst),
        n_tiles{size[1] / kCells + 1, size[2] / kCells + 1},
        rows(std::size_t(n_tiles[0]) * n_tiles[1], std::size_t(length) * kNodes * kNodes) {}

  /// The sums along all rows of a tile, kFirst the first node of each.
  const float* sums(int tj, int tk) {
    return rows.tile(std::size_t(tk) * n_tiles[0] + tj, [&](float* out) {
      const std::array<int, 3> lower = {kFirst, tj * kCells - 2, tk * kCells - 2};
      nodal_values(lower, {kFirst + length, lower[1] + kNodes, lower[2] + kNodes}, out);
      for (int row = 0; row < kNodes * kNodes; ++row, out += length) {
        double sum = 0;
        for (int i = 0; i < length; ++i) out[i] = static_cast<float>(sum += out[i]);
      }
    });
  }

  double value(const Vector<3>& x) {
    const Vector<3> u = world_to_index * x;
    std::array<int, 3> cell;  // from that before the first node on
    std::array<double, 3> fraction;
    double beyond = 0;  // where the constant continuation has begun
    for (int axis = 0; axis < 3; ++axis) {
      const double clamped = std::clamp(u[axis], -0.5, size[axis] - 0.5);
      if (axis == 0) beyond = u[axis] - clamped;
      cell[axis] = static_cast<int>(clamped + 1);
      fraction[axis] = clamped + 1 - cell[axis];
    }
    const std::array<double, 5> along = quartic_weights(fraction[0]);
    const SplineWeights slope(fraction[0], Derivatives::kNone), wy(fraction[1], Derivatives::kNone),
        wz(fraction[2], Derivatives::kNone);
    const float* tile = sums(cell[1] / kCells, cell[2] / kCells);
    double sum = 0;
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j) {
        const float* C = tile +
                         std::size_t((cell[2] % kCells + k) * kNodes + cell[1] % kCells + j) *
                             std::size_t(length) +
                         cell[0];
        double row = 0;
        for (int n = 0; n < 5; ++n) row += along[n] * C[n];
        if (beyond != 0)
          for (int n = 0; n < 4; ++n) row += beyond * slope.value[n] * (double(C[n + 1]) - C[n]);
        sum += wy.value[j] * wz.value[k] * row;
      }
    return sum;
  }

  std::array<int, 3> size;
  Eigen::Affine3d world_to_index;
  NodalValues nodal_values;
  int length;  // of a row
  std::array<int, 2> n_tiles;
  TileStore rows;
};

SplineIntegral::SplineIntegral(const Grid& grid, NodalValues nodal_values)
    : impl_(std::make_unique<Impl>(grid, std::move(nodal_values))) {}

SplineIntegral::~SplineIntegral() = default;

void SplineIntegral::sample(const Points<3>& x, Derivatives, Samples<3>& out) const {
  out.resize(x.rows(), Derivatives::kNone);
  // Isolated: a thread that waits here must not take up another run's work meanwhile.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, x.rows(), kBlock),
                      [&](const tbb::blocked_range<Eigen::Index>& range) {
                        for (Eigen::Index at = range.begin(); at < range.end(); ++at)
                          out.value[at] = impl_->value(x.row(at));
                      });
  });
}

std::size_t SplineIntegral::memory_bytes() const { return impl_->rows.memory_bytes(); }

}  // namespace surf::volume
