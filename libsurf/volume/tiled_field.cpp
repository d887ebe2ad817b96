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

  void sample_point(const Vector<3>& x, Derivatives order, Eigen::Index at, Samples<3>& out) {
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
    const SplineSums<3> sums(
        {SplineWeights(fraction[0]), SplineWeights(fraction[1]), SplineWeights(fraction[2])}, order,
        [&](int j, int k) -> SplineRow {
          return Eigen::Map<const Eigen::Array4f>(coefficients + (k * kNodes + j) * kNodes)
              .cast<double>();
        });
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
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, x.rows(), kBlock),
                      [&](const tbb::blocked_range<Eigen::Index>& range) {
                        for (Eigen::Index at = range.begin(); at < range.end(); ++at)
                          impl_->sample_point(x.row(at), order, at, out);
                      });
  });
}

std::size_t TiledField::n_tiles() const { return impl_->tiles->n_computed(); }

std::size_t TiledField::memory_bytes() const { return impl_->tiles->memory_bytes(); }

}  // namespace surf::volume
