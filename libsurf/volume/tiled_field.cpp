#include "libsurf/volume/tiled_field.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "libsurf/volume/detail/spline.h"

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
    tiles = std::vector<std::atomic<float*>>(std::size_t(n_tiles[0]) * n_tiles[1] * n_tiles[2]);
  }
  ~Impl() {
    for (auto& tile : tiles) delete[] tile.load();
  }

  /// The coefficients of a tile. Two threads may both compute it; they get the same values,
  /// and one of the two is dropped.
  const float* tile(int ti, int tj, int tk) {
    auto& slot = tiles[(std::size_t(tk) * n_tiles[1] + tj) * n_tiles[0] + ti];
    if (float* ready = slot.load(std::memory_order_acquire)) return ready;
    auto fresh = std::make_unique<float[]>(kNodes * kNodes * kNodes);
    const std::array<int, 3> lower = {ti * kCells - 2, tj * kCells - 2, tk * kCells - 2};
    nodal_values(lower, {lower[0] + kNodes, lower[1] + kNodes, lower[2] + kNodes}, fresh.get());
    float* expected = nullptr;
    if (slot.compare_exchange_strong(expected, fresh.get(), std::memory_order_acq_rel)) {
      count.fetch_add(1, std::memory_order_relaxed);
      return fresh.release();
    }
    return expected;
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
    const SplineWeights wx(fraction[0]), wy(fraction[1]), wz(fraction[2]);
    if (order == Derivatives::kNone)
      out.value[at] = value(coefficients, wx, wy, wz);
    else
      derivatives(coefficients, wx, wy, wz, moves, order, at, out);
  }

  static double value(const float* c, const SplineWeights& wx, const SplineWeights& wy,
                      const SplineWeights& wz) {
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      double plane = 0;
      for (int j = 0; j < 4; ++j)
        plane += wy.value[j] * dot(wx.value, c + (k * kNodes + j) * kNodes);
      sum += wz.value[k] * plane;
    }
    return sum;
  }

  void derivatives(const float* c, const SplineWeights& wx, const SplineWeights& wy,
                   const SplineWeights& wz, const std::array<double, 3>& moves, Derivatives order,
                   Eigen::Index at, Samples<3>& out) const {
    double v = 0;
    Vector<3> g = Vector<3>::Zero();
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 4; ++k) {
      double p = 0, px = 0, py = 0, pxx = 0, pxy = 0, pyy = 0;
      for (int j = 0; j < 4; ++j) {
        const float* row = c + (k * kNodes + j) * kNodes;
        const double r = dot(wx.value, row), rx = dot(wx.first, row), rxx = dot(wx.second, row);
        p += wy.value[j] * r;
        px += wy.value[j] * rx;
        py += wy.first[j] * r;
        pxx += wy.value[j] * rxx;
        pxy += wy.first[j] * rx;
        pyy += wy.second[j] * r;
      }
      v += wz.value[k] * p;
      g += Vector<3>(wz.value[k] * px, wz.value[k] * py, wz.first[k] * p);
      h(0, 0) += wz.value[k] * pxx;
      h(0, 1) += wz.value[k] * pxy;
      h(1, 1) += wz.value[k] * pyy;
      h(0, 2) += wz.first[k] * px;
      h(1, 2) += wz.first[k] * py;
      h(2, 2) += wz.second[k] * p;
    }
    h(1, 0) = h(0, 1);
    h(2, 0) = h(0, 2);
    h(2, 1) = h(1, 2);
    const Vector<3> inside(moves[0], moves[1], moves[2]);
    g = g.cwiseProduct(inside);
    h = inside.asDiagonal() * h * inside.asDiagonal();
    const Eigen::Matrix3d& index_from_world = world_to_index.linear();
    out.value[at] = v;
    out.gradient.row(at) = index_from_world.transpose() * g;
    if (order == Derivatives::kSecond) {
      const Eigen::Matrix3d world = index_from_world.transpose() * h * index_from_world;
      out.hessian.row(at) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(world.data());
    }
  }

  std::array<int, 3> size;
  Eigen::Affine3d world_to_index;
  NodalValues nodal_values;
  std::array<int, 3> n_tiles;
  std::vector<std::atomic<float*>> tiles;
  std::atomic<std::size_t> count{0};
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

std::size_t TiledField::n_tiles() const { return impl_->count.load(); }

std::size_t TiledField::memory_bytes() const {
  return n_tiles() * kNodes * kNodes * kNodes * sizeof(float) +
         impl_->tiles.size() * sizeof(std::atomic<float*>);
}

}  // namespace surf::volume
