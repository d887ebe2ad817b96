#include "libsurf/volume/detail/cut_matrix.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surf::volume {
namespace {

// A function is active if its row is not smaller than this share of that of a whole cell.
constexpr double kLeastRow = 1e-12;

/// Number of the neighbour at (x, y, z), each -1, 0 or 1.
int neighbour(int x, int y, int z) { return (z + 1) * 9 + (y + 1) * 3 + x + 1; }

/// Adds the row of a node in the cell of which it is the corner (x, y, z).
void add_cell(const fem::CellMatrix& matrix, int x, int y, int z, std::array<double, 27>& row) {
  const int a = x + 2 * y + 4 * z;
  for (int b = 0; b < 8; ++b)
    row[neighbour((b & 1) - x, (b >> 1 & 1) - y, (b >> 2) - z)] += matrix(a, b);
}

double sum_of_sizes(const std::array<double, 27>& row) {
  double sum = 0;
  for (const double entry : row) sum += std::abs(entry);
  return sum;
}

/// 0 at the first node of an axis, 2 at the last one, else 1.
int place(int index, int size) { return index == 0 ? 0 : index == size - 1 ? 2 : 1; }

/// By the cells of a node that are in the grid.
enum class NodeKind : char { kNone, kRegular, kOwn };

/// Kinds of the nodes along i: first of the cells that the nodes of the line have in common.
void kinds_of_line(const DomainCells& cells, int j, int k, std::vector<NodeKind>& kinds) {
  const auto& size = cells.size;
  constexpr int kMixed = 1;  // no state of a cell that is not cut
  std::vector<std::int32_t> states(size[0]);
  bool is_first = true;
  for (int z = std::max(k - 1, 0); z <= std::min(k, size[2] - 1); ++z)
    for (int y = std::max(j - 1, 0); y <= std::min(j, size[1] - 1); ++y, is_first = false) {
      const std::int32_t* line = cells.state.data() + cells.cell(0, y, z);
      for (int i = 0; i < size[0]; ++i) {
        const std::int32_t state = std::min(line[i], 0);  // 0 if it is cut
        states[i] = is_first || states[i] == state ? state : kMixed;
      }
    }
  for (int i = 0; i <= size[0]; ++i) {
    const std::int32_t before = states[std::max(i - 1, 0)],
                       after = states[std::min(i, size[0] - 1)];
    kinds[i] = before != after || before >= 0 ? NodeKind::kOwn
               : before == DomainCells::kFull ? NodeKind::kRegular
                                              : NodeKind::kNone;
  }
}

std::vector<fem::CellMatrix> cut_matrices(const DomainCells& cells, const fem::CellMetric& metric,
                                          double mass, double stiffness) {
  std::vector<fem::CellMatrix> out(cells.moments.size());
  tbb::parallel_for(std::size_t(0), out.size(), [&](std::size_t n) {
    out[n] = fem::cell_matrix(cells.moments[n], metric, mass, stiffness);
  });
  return out;
}

}  // namespace

CutMatrix::CutMatrix(const DomainCells& cells, const Eigen::Matrix3d& index_to_world, double mass,
                     double stiffness)
    : box_{{cells.size[0] + 1, cells.size[1] + 1, cells.size[2] + 1}} {
  const auto stride = box_.strides();
  for (int n = 0; n < 27; ++n)
    offsets_[n] = (n / 9 - 1) * std::ptrdiff_t(stride[2]) +
                  (n / 3 % 3 - 1) * std::ptrdiff_t(stride[1]) + (n % 3 - 1);
  const fem::CellMetric metric(index_to_world);
  const fem::CellMatrix full = fem::cell_matrix(fem::full_moments(), metric, mass, stiffness);
  make_stencils(full);
  const std::vector<fem::CellMatrix> cut = cut_matrices(cells, metric, mass, stiffness);
  inverse_scale_.assign(box_.n_values(), 0);
  slabs_.resize(box_.size[2]);
  tbb::parallel_for(0, box_.size[2], [&](int k) { fill_slab(cells, cut, full, k); });
}

/// Of nodes all of whose cells in the grid are full.
void CutMatrix::make_stencils(const fem::CellMatrix& full) {
  for (int type = 0; type < 27; ++type) {
    const std::array<int, 3> at = {type % 3, type / 3 % 3, type / 9};
    Row row{};
    for (int z = 0; z < 2; ++z)
      for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
          const std::array<int, 3> corner = {x, y, z};
          bool is_in_grid = true;  // the first node is no upper corner, the last one no lower one
          for (int axis = 0; axis < 3; ++axis)
            is_in_grid &= at[axis] != (corner[axis] == 1 ? 0 : 2);
          if (is_in_grid) add_cell(full, x, y, z, row);
        }
    stencils_[type] = row;
    stencil_scales_[type] = sum_of_sizes(row);
  }
}

CutMatrix::Row CutMatrix::row_of(const DomainCells& cells, std::span<const fem::CellMatrix> cut,
                                 const fem::CellMatrix& full,
                                 const std::array<int, 3>& node) const {
  Row row{};
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 2; ++x) {
        const std::int32_t state = cells.at(node[0] - x, node[1] - y, node[2] - z);
        if (state != DomainCells::kEmpty)
          add_cell(state == DomainCells::kFull ? full : cut[state], x, y, z, row);
      }
  return row;
}

void CutMatrix::fill_slab(const DomainCells& cells, std::span<const fem::CellMatrix> cut,
                          const fem::CellMatrix& full, int k) {
  const auto& size = box_.size;
  Slab& slab = slabs_[k];
  const auto add_regular = [&](std::size_t node, int stencil) {
    inverse_scale_[node] = 1 / stencil_scales_[stencil];
    Run* last = slab.runs.empty() ? nullptr : &slab.runs.back();
    if (last && last->stencil == stencil && last->nodes.begin + last->nodes.n == node)
      ++last->nodes.n;
    else
      slab.runs.push_back({{node, 1}, stencil});
  };
  const auto add_own = [&](std::size_t node, const Row& row) {
    const double scale = sum_of_sizes(row);
    if (!(scale > kLeastRow * stencil_scales_[13])) return false;
    inverse_scale_[node] = 1 / scale;
    slab.cut_nodes.push_back(node);
    slab.cut_rows.push_back(row);
    return true;
  };
  std::vector<NodeKind> kinds(size[0]);
  for (int j = 0; j < size[1]; ++j) {
    kinds_of_line(cells, j, k, kinds);
    const std::size_t line = box_.at(0, j, k);
    int first = -1, last = -1;
    for (int i = 0; i < size[0]; ++i) {
      if (kinds[i] == NodeKind::kNone) continue;
      if (kinds[i] == NodeKind::kRegular)
        add_regular(line + i, place(i, size[0]) + 3 * place(j, size[1]) + 9 * place(k, size[2]));
      else if (!add_own(line + i, row_of(cells, cut, full, {i, j, k})))
        continue;
      if (first < 0) first = i;
      last = i;
    }
    if (first >= 0) slab.active.push_back({line + first, last - first + 1});
  }
}

std::span<const NodeRange> CutMatrix::active(int k) const { return slabs_[k].active; }

void CutMatrix::multiply_slab(const Slab& slab, const double* x, double* y) const {
  for (const Run& run : slab.runs) {
    const Row& s = stencils_[run.stencil];
    double* __restrict out = y + run.nodes.begin;
    const double* in = x + run.nodes.begin;
    const int n = run.nodes.n;
    for (int line = 0; line < 9; ++line) {
      const double a = s[3 * line], b = s[3 * line + 1], c = s[3 * line + 2];
      const double* __restrict from = in + offsets_[3 * line + 1];
      if (line == 0)
        for (int i = 0; i < n; ++i) out[i] = a * from[i - 1] + b * from[i] + c * from[i + 1];
      else
        for (int i = 0; i < n; ++i) out[i] += a * from[i - 1] + b * from[i] + c * from[i + 1];
    }
  }
  for (std::size_t m = 0; m < slab.cut_nodes.size(); ++m) {
    const double* from = x + slab.cut_nodes[m];
    const Row& row = slab.cut_rows[m];
    double sum = 0;
    for (int n = 0; n < 27; ++n) sum += row[n] * from[offsets_[n]];
    y[slab.cut_nodes[m]] = sum;
  }
}

void CutMatrix::multiply(const Values& x, Values& y) const {
  tbb::parallel_for(std::size_t(0), slabs_.size(),
                    [&](std::size_t k) { multiply_slab(slabs_[k], x.data(), y.data()); });
}

void CutMatrix::residual(const Values& b, const Values& x, Values& y) const {
  tbb::parallel_for(std::size_t(0), slabs_.size(), [&](std::size_t k) {
    multiply_slab(slabs_[k], x.data(), y.data());
    for (const NodeRange& range : slabs_[k].active)
      for (std::size_t n = range.begin; n < range.begin + range.n; ++n) y[n] = b[n] - y[n];
  });
}

}  // namespace surf::volume
