#include "libsurf/volume/tiled_field.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "libsurf/volume/detail/spline.h"
#include "libsurf/volume/detail/tile_store.h"

namespace surf::volume {
namespace {

constexpr int kCells = 16;          // cells per tile and axis
constexpr int kNodes = kCells + 3;  // the cubic B-spline of a cell reaches from node -1 to 2
constexpr int kBlock = 64;          // points per task

}  // namespace

struct TiledField::Impl {
  struct RowsOfTile {
    const float* coefficients;
    SURF_INLINE SplineRow operator()(int j, int k) const {
      return row_of(coefficients + (k * kNodes + j) * kNodes);
    }
  };

  Impl(const Grid& grid, NodalValues values)
      : size(grid.size),
        world_to_index(grid.index_to_world.inverse()),
        nodal_values(std::move(values)) {
    for (int axis = 0; axis < 3; ++axis) n_tiles[axis] = size[axis] / kCells + 1;
    tiles = std::make_unique<TileStore>(std::size_t(n_tiles[0]) * n_tiles[1] * n_tiles[2],
                                        std::size_t(kNodes) * kNodes * kNodes);
  }

  /// The coefficients of a tile.
  const float* tile(int ti, int tj, int tk) {
    return tiles->tile((std::size_t(tk) * n_tiles[1] + tj) * n_tiles[0] + ti, [&](float* out) {
      const std::array<int, 3> lower = {ti * kCells - 2, tj * kCells - 2, tk * kCells - 2};
      nodal_values(lower, {lower[0] + kNodes, lower[1] + kNodes, lower[2] + kNodes}, out);
    });
  }

  SURF_INLINE void sample_point(const Vector<3>& x, Derivatives order, Eigen::Index at,
                                Samples<3>& out) {
    const Vector<3> u = world_to_index * x;
    std::array<int, 3> cell;                // from that before the first node on
    std::array<double, 3> fraction, moves;  // moves: 0 where the constant continuation begins
    for (int axis = 0; axis < 3; ++axis) {
      const double clamped = std::clamp(u[axis], -0.5, size[axis] - 0.5);
      moves[axis] = clamped == u[axis] ? 1 : 0;
      cell[axis] = static_cast<int>(clamped + 1);
      fraction[axis] = clamped + 1 - cell[axis];
    }
    const float* coefficients = tile(cell[0] / kCells, cell[1] / kCells, cell[2] / kCells) +
                                ((cell[2] % kCells) * kNodes + cell[1] % kCells) * kNodes +
                                cell[0] % kCells;
    const SplineSums<3> sums({SplineWeights(fraction[0], order), SplineWeights(fraction[1], order),
                              SplineWeights(fraction[2], order)},
                             order, RowsOfTile{coefficients});
    out.value[at] = sums.value;
    if (order == Derivatives::kNone) return;
    const Vector<3> inside(moves[0], moves[1], moves[2]);
    const Eigen::Matrix3d& index_from_world = world_to_index.linear();
    out.gradient.row(at) = index_from_world.transpose() * sums.gradient.cwiseProduct(inside);
    if (order == Derivatives::kFirst) return;
    const Eigen::Matrix3d world = index_from_world.transpose() *
                                  (inside.asDiagonal() * sums.hessian * inside.asDiagonal()) *
                                  index_from_world;
    out.hessian.row(at) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(world.data());
  }

  using Range = tbb::blocked_range<Eigen::Index>;
  SURF_INLINE void sample_each(const Points<3>& x, const Range& range, Derivatives order,
                               Samples<3>& out) {
    for (Eigen::Index at = range.begin(); at < range.end(); ++at)
      sample_point(x.row(at), order, at, out);
  }
  SURF_AVX2 void sample_by_avx2(const Points<3>& x, const Range& range, Derivatives order,
                                Samples<3>& out) {
    sample_each(x, range, order, out);
  }
  void sample_range(const Points<3>& x, const Range& range, Derivatives order, Samples<3>& out) {
    if (has_avx2())
      sample_by_avx2(x, range, order, out);
    else
      sample_each(x, range, order, out);
  }

  std::array<int, 3> size;
  Eigen::Affine3d world_to_index;
  NodalValues nodal_values;
  std::array<int, 3> n_tiles;
  std::unique_ptr<TileStore> tiles;
};

TiledField::TiledField(const Grid& grid, NodalValues nodal_values)
    : impl_(std::make_unique<Impl>(grid, std::move(nodal_values))) {}

TiledField::~TiledField() = default;

void TiledField::sample(const Points<3>& x, Derivatives order, Samples<3>& out) const {
  out.resize(x.rows(), order);
  // Isolated: a thread that waits here must not take up another run's work meanwhile.
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(Impl::Range(0, x.rows(), kBlock),
                      [&](const Impl::Range& range) { impl_->sample_range(x, range, order, out); });
  });
}

std::size_t TiledField::n_tiles() const { return impl_->tiles->n_computed(); }

std::size_t TiledField::memory_bytes() const { return impl_->tiles->memory_bytes(); }

}  // namespace surf::volume
