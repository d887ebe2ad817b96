#include "libsurf/volume/detail/multigrid.h"

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

/// Calls visit(first, end) for the active ranges, the slabs in parallel.
template <class Visit>
void for_ranges(const CutMatrix& matrix, const Visit& visit) {
  tbb::parallel_for(0, matrix.box().size[2], [&](int k) {
    for (const NodeRange& range : matrix.active(k)) visit(range.begin, range.begin + range.n);
  });
}

/// Chebyshev's iteration for eigenvalues of the scaled matrix in [least, 1].
/// @param is_zero  x is 0, whatever its values are
void smooth(const CutMatrix& matrix, const Values& rhs, int n_sweeps, double least, bool is_zero,
            Values& x, Values& residual, Values& step) {
  const double* scale = matrix.inverse_scale().data();
  const double theta = (1 + least) / 2, delta = (1 - least) / 2, sigma = theta / delta;
  double rho = 1 / sigma;
  if (!is_zero) matrix.residual(rhs, x, residual);
  const double* first = is_zero ? rhs.data() : residual.data();
  double *to = x.data(), *d = step.data();
  for_ranges(matrix, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) d[n] = scale[n] * first[n] / theta;
    if (is_zero)
      std::copy(d + begin, d + end, to + begin);
    else
      for (std::size_t n = begin; n < end; ++n) to[n] += d[n];
  });
  for (int sweep = 1; sweep < n_sweeps; ++sweep) {
    matrix.residual(rhs, x, residual);
    const double* r = residual.data();
    const double next = 1 / (2 * sigma - rho), keep = next * rho, add = 2 * next / delta;
    rho = next;
    for_ranges(matrix, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        d[n] = keep * d[n] + add * scale[n] * r[n];
        to[n] += d[n];
      }
    });
  }
}

/// Calls visit(line of the coarse nodes, weight) for those that fine ones of (j, k) lie between.
template <class Visit>
void for_parent_lines(int j, int k, const std::array<int, 3>& factor, const Visit& visit) {
  const int n_j = j % factor[1] + 1, n_k = k % factor[2] + 1;
  for (int c = 0; c < n_k; ++c)
    for (int b = 0; b < n_j; ++b) visit(j / factor[1] + b, k / factor[2] + c, 1.0 / (n_j * n_k));
}

/// Adds the interpolant of the coarse values to x.
void prolong(const CutMatrix& coarse, const Values& from, const CutMatrix& fine,
             const std::array<int, 3>& factor, Values& x) {
  const PaddedGrid &box = fine.box(), &coarse_box = coarse.box();
  tbb::parallel_for(0, box.size[2], [&](int k) {
    std::vector<double> line(coarse_box.size[0] + 1);
    for (const NodeRange& range : fine.active(k)) {
      const auto [first, j] = box.place_in_slab(range.begin);
      std::fill(line.begin(), line.end(), 0);
      for_parent_lines(j, k, factor, [&](int b, int c, double weight) {
        const double* values = from.data() + coarse_box.at(0, b, c);
        for (int i = 0; i < coarse_box.size[0]; ++i) line[i] += weight * values[i];
      });
      for (int i = first; i < first + range.n; ++i) {
        const std::size_t n = range.begin + (i - first);
        if (!fine.is_active(n)) continue;
        const int low = i / factor[0];
        x[n] += i % factor[0] == 0 ? line[low] : (line[low] + line[low + 1]) / 2;
      }
    }
  });
}

/// Transpose of prolong.
void restrict_to(const CutMatrix& coarse, const CutMatrix& fine, const Values& from,
                 const std::array<int, 3>& factor, Values& to) {
  const PaddedGrid &box = coarse.box(), &fine_box = fine.box();
  tbb::parallel_for(0, box.size[2], [&](int k) {
    std::vector<double> line(fine_box.size[0] + 3);  // from node -1 on
    for (const NodeRange& range : coarse.active(k)) {
      const auto [first, j] = box.place_in_slab(range.begin);
      std::fill(line.begin(), line.end(), 0);
      for (int c = 1 - factor[2]; c < factor[2]; ++c)
        for (int b = 1 - factor[1]; b < factor[1]; ++b) {
          const int y = j * factor[1] + b, z = k * factor[2] + c;
          if (y < 0 || z < 0 || y >= fine_box.size[1] || z >= fine_box.size[2]) continue;
          const double weight = 1.0 / (1 << ((b != 0) + (c != 0)));
          const double* values = from.data() + fine_box.at(0, y, z);
          for (int i = 0; i < fine_box.size[0]; ++i) line[i + 1] += weight * values[i];
        }
      for (int i = first; i < first + range.n; ++i) {
        const std::size_t n = range.begin + (i - first);
        if (!coarse.is_active(n)) continue;
        const double* centre = line.data() + 1 + i * factor[0];
        const bool is_last = i * factor[0] >= fine_box.size[0];  // beyond the fine grid's end
        to[n] = is_last ? 0 : centre[0];
        if (factor[0] == 2) to[n] += (centre[-1] + (is_last ? 0 : centre[1])) / 2;
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
