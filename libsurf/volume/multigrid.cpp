#include "libsurf/volume/multigrid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surf::volume {
namespace {

constexpr int kLeastCells = 4;       // an axis with fewer is not coarsened
constexpr double kSameLength = 1.5;  // longer cells than this, of the shortest, wait
constexpr int kSweeps = 2;
constexpr double kSmoothed = 0.12;  // least eigenvalue that the smoother treats, the largest is 1
constexpr int kCoarsestSweeps = 8;
constexpr double kCoarsest = 0.02;

/// Calls visit(node) for the nodes of the active ranges, the slabs in parallel.
template <class Visit>
void for_active(const CutMatrix& matrix, const Visit& visit) {
  tbb::parallel_for(0, matrix.box().size[2], [&](int k) {
    for (const NodeRange& range : matrix.active(k))
      for (std::size_t n = range.begin; n < range.begin + range.n; ++n) visit(n);
  });
}

/// Chebyshev's iteration for eigenvalues of the scaled matrix in [least, 1].
void smooth(const CutMatrix& matrix, const Values& rhs, int n_sweeps, double least, bool is_zero,
            Values& x, Values& residual, Values& step) {
  const Values& scale = matrix.inverse_scale();
  const double theta = (1 + least) / 2, delta = (1 - least) / 2, sigma = theta / delta;
  double rho = 1 / sigma;
  for (int sweep = 0; sweep < n_sweeps; ++sweep) {
    const bool is_first = sweep == 0;
    if (!is_first || !is_zero) matrix.residual(rhs, x, residual);
    const Values& r = is_first && is_zero ? rhs : residual;
    const double next = 1 / (2 * sigma - rho);
    const double keep = is_first ? 0 : next * rho, add = is_first ? 1 / theta : 2 * next / delta;
    if (!is_first) rho = next;
    for_active(matrix, [&](std::size_t n) {
      step[n] = keep * step[n] + add * scale[n] * r[n];
      x[n] = is_first && is_zero ? step[n] : x[n] + step[n];
    });
  }
}

/// Calls visit(coarse node, weight) for the nodes that a fine one is interpolated from.
template <class Visit>
void for_parents(const std::array<int, 3>& fine, const std::array<int, 3>& factor,
                 const Visit& visit) {
  std::array<int, 3> low, n;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = fine[axis] / factor[axis];
    n[axis] = fine[axis] % factor[axis] + 1;
  }
  const double weight = 1.0 / (n[0] * n[1] * n[2]);
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x) visit(low[0] + x, low[1] + y, low[2] + z, weight);
}

/// Adds the interpolant of the coarse values to x.
void prolong(const CutMatrix& coarse, const Values& from, const CutMatrix& fine,
             const std::array<int, 3>& factor, Values& x) {
  const NodeBox& box = fine.box();
  tbb::parallel_for(0, box.size[2], [&](int k) {
    for (const NodeRange& range : fine.active(k)) {
      const std::size_t stride = box.strides()[1];
      const int j = int(range.begin / stride % (box.size[1] + 2)) - 1;
      const int first = int(range.begin % stride) - 1;
      for (int m = 0; m < range.n; ++m) {
        if (!fine.is_active(range.begin + m)) continue;
        double sum = 0;
        for_parents({first + m, j, k}, factor, [&](int a, int b, int c, double weight) {
          sum += weight * from[coarse.box().at(a, b, c)];
        });
        x[range.begin + m] += sum;
      }
    }
  });
}

/// Transpose of prolong.
void restrict_to(const CutMatrix& coarse, const CutMatrix& fine, const Values& from,
                 const std::array<int, 3>& factor, Values& to) {
  const NodeBox &box = coarse.box(), &fine_box = fine.box();
  tbb::parallel_for(0, box.size[2], [&](int k) {
    for (const NodeRange& range : coarse.active(k)) {
      const std::size_t stride = box.strides()[1];
      const int j = int(range.begin / stride % (box.size[1] + 2)) - 1;
      const int first = int(range.begin % stride) - 1;
      for (int m = 0; m < range.n; ++m) {
        if (!coarse.is_active(range.begin + m)) continue;
        const std::array<int, 3> centre = {(first + m) * factor[0], j * factor[1], k * factor[2]};
        std::array<int, 3> low, high;
        for (int axis = 0; axis < 3; ++axis) {
          low[axis] = std::max(centre[axis] - factor[axis] + 1, 0);
          high[axis] = std::min(centre[axis] + factor[axis] - 1, fine_box.size[axis] - 1);
        }
        double sum = 0;
        for (int c = low[2]; c <= high[2]; ++c)
          for (int b = low[1]; b <= high[1]; ++b)
            for (int a = low[0]; a <= high[0]; ++a) {
              const int n_apart = (a != centre[0]) + (b != centre[1]) + (c != centre[2]);
              sum += from[fine_box.at(a, b, c)] / (1 << n_apart);
            }
        to[range.begin + m] = sum;
      }
    }
  });
}

/// 2 along the axes that are coarsened next; all 1 if the cells are long enough.
std::array<int, 3> next_factor(const DomainCells& cells, const Eigen::Matrix3d& index_to_world,
                               double length) {
  double shortest = length;
  for (int axis = 0; axis < 3; ++axis)
    if (cells.size[axis] >= kLeastCells)
      shortest = std::min(shortest, index_to_world.col(axis).norm());
  std::array<int, 3> factor = {1, 1, 1};
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = index_to_world.col(axis).norm();
    if (shortest < length && cells.size[axis] >= kLeastCells && spacing < kSameLength * shortest)
      factor[axis] = 2;
  }
  return factor;
}

}  // namespace

void Multigrid::Level::allocate(bool is_finest) {
  const std::size_t n = matrix.box().n_values();
  residual.assign(n, 0);
  step.assign(n, 0);
  if (is_finest) return;
  rhs.assign(n, 0);
  solution.assign(n, 0);
}

Multigrid::Multigrid(DomainCells cells, const Eigen::Matrix3d& index_to_world, double mu) {
  Eigen::Matrix3d axes = index_to_world;
  while (true) {
    const std::array<int, 3> factor = next_factor(cells, axes, std::sqrt(mu));
    levels_.push_back({CutMatrix(cells, axes, 1, mu), factor, {}, {}, {}, {}});
    levels_.back().allocate(levels_.size() == 1);
    if (factor == std::array{1, 1, 1}) return;
    cells = coarsened(cells, factor);
    for (int axis = 0; axis < 3; ++axis) axes.col(axis) *= factor[axis];
  }
}

void Multigrid::precondition(const Values& r, Values& z) { cycle(0, r, z); }

void Multigrid::cycle(std::size_t at, const Values& rhs, Values& solution) {
  Level& level = levels_[at];
  if (at + 1 == levels_.size())
    return smooth(level.matrix, rhs, kCoarsestSweeps, kCoarsest, true, solution, level.residual,
                  level.step);
  smooth(level.matrix, rhs, kSweeps, kSmoothed, true, solution, level.residual, level.step);
  level.matrix.residual(rhs, solution, level.residual);
  Level& coarse = levels_[at + 1];
  restrict_to(coarse.matrix, level.matrix, level.residual, level.factor, coarse.rhs);
  cycle(at + 1, coarse.rhs, coarse.solution);
  prolong(coarse.matrix, coarse.solution, level.matrix, level.factor, solution);
  smooth(level.matrix, rhs, kSweeps, kSmoothed, false, solution, level.residual, level.step);
}

}  // namespace surf::volume
