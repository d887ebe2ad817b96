#include "libsurf/base/detail/supernodes.h"

#include <cblas-openblas.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <optional>
#include <stdexcept>
#include <utility>

#include "libsurf/base/detail/one_blas_thread.h"

extern "C" int dpotrf_(const char* triangle, const int* n, double* A, const int* stride, int* info);

namespace surf {
namespace {

// A branch has at most this share of the operations, or so many of them.
constexpr double kBranchShare = 1.0 / 32, kBranchLeast = 1e6;
constexpr double kPerNode = 2e3;  // operations that a block costs besides its own
constexpr double kLarge = 2e7;    // operations of a block that is dealt out
constexpr int kTile = 128;        // its rows and columns, in one task

/// Of a block of so many columns with so many rows below them, about.
double operations(double n_columns, double n_below) {
  return n_columns * (n_columns * n_columns / 3 + n_columns * n_below + n_below * n_below) +
         kPerNode;
}

/// Calls f(0), ..., f(n - 1) on all cores, each as one that calls BLAS, and nothing else meanwhile.
template <class Function>
void on_all_cores(int n, const Function& f) {
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(0, n, [&](int task) {
      const OneBlasThread one;
      f(task);
    });
  });
}

/// Calls f(first, n) for so many rows or columns at once.
template <class Function>
void for_tiles(int n, const Function& f) {
  on_all_cores((n + kTile - 1) / kTile,
               [&](int tile) { f(tile * kTile, std::min(kTile, n - tile * kTile)); });
}

/// Likewise f(row, n_rows, column, n_columns) for what is on and below the diagonal of the first so
/// many columns.
template <class Function>
void for_lower_tiles(int n_rows, int n_columns, const Function& f) {
  std::vector<std::pair<int, int>> tiles;
  for (int column = 0; column < n_columns; column += kTile)
    for (int row = column; row < n_rows; row += kTile) tiles.emplace_back(row, column);
  on_all_cores(int(tiles.size()), [&](int tile) {
    const auto [row, column] = tiles[std::size_t(tile)];
    f(row, std::min(kTile, n_rows - row), column, std::min(kTile, n_columns - column));
  });
}

/// C -= A B^T of a tile, (n_rows, n_columns) with k columns of A and B; only what is on and below
/// the diagonal where the tile is on it.
void subtract(bool is_on_diagonal, int n_rows, int n_columns, int k, const double* A,
              const double* B, int stride, double* C, int stride_of_C) {
  if (is_on_diagonal) {
    cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n_columns, k, -1, A, stride, 1, C,
                stride_of_C);
    // A tile on the diagonal has as many rows, or more than the last columns are.
    if (n_rows == n_columns) return;
    A += n_columns, C += n_columns, n_rows -= n_columns;
  }
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, n_rows, n_columns, k, -1, A, stride, B,
              stride, 1, C, stride_of_C);
}

/// L of a block's columns, in place; whether it is positive definite.
bool factor_block(int m, int n_rows, double* block) {
  int info = 0;
  dpotrf_("L", &m, block, &n_rows, &info);
  if (info != 0) return false;
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, n_rows - m, m, 1,
              block, n_rows, block + m, n_rows);
  return true;
}

/// The same on all cores, kTile columns at a time.
bool factor_large_block(int m, int n_rows, double* block) {
  for (int first = 0; first < m; first += kTile) {
    const int n = std::min(kTile, m - first), n_below = n_rows - first - n;
    double* const corner = block + std::size_t(first) * n_rows + first;
    int info = 0;
    {
      const OneBlasThread one;
      dpotrf_("L", &n, corner, &n_rows, &info);
    }
    if (info != 0) return false;
    double* const panel = corner + n;
    for_tiles(n_below, [&](int row, int n_in_tile) {
      cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, n_in_tile, n, 1,
                  corner, n_rows, panel + row, n_rows);
    });
    double* const rest = panel + std::size_t(n) * n_rows;
    for_lower_tiles(
        n_below, m - first - n, [&](int row, int n_in_rows, int column, int n_in_columns) {
          subtract(row == column, n_in_rows, n_in_columns, n, panel + row, panel + column, n_rows,
                   rest + std::size_t(column) * n_rows + row, n_rows);
        });
  }
  return true;
}

/// Where what runs this was cancelled by an error elsewhere, some have not been done.
void finish(tbb::task_group& tasks) {
  if (tasks.wait() != tbb::complete) throw std::runtime_error("a Cholesky factor was cancelled");
}

}  // namespace

SupernodeTree::SupernodeTree(const cholmod_factor& L, const Eigen::SparseMatrix<double>& A)
    : n_(L.n),
      n_values_(L.xsize),
      begins_(A.outerIndexPtr(), A.outerIndexPtr() + A.outerSize() + 1),
      nonzeros_(A.innerIndexPtr(), A.innerIndexPtr() + A.nonZeros()) {
  const auto *super = static_cast<const int*>(L.super), *pi = static_cast<const int*>(L.pi),
             *px = static_cast<const int*>(L.px), *s = static_cast<const int*>(L.s),
             *order = static_cast<const int*>(L.Perm);
  rows_.assign(s, s + L.ssize);
  in_parent_.resize(L.ssize);
  std::vector<int> node_of(n_), place(n_);
  for (int k = 0; k < int(L.nsuper); ++k) {
    Node& node = nodes_.emplace_back();
    node.first_column = super[k];
    node.n_columns = super[k + 1] - super[k];
    node.rows = std::size_t(pi[k]);
    node.n_rows = pi[k + 1] - pi[k];
    node.values = std::size_t(px[k]);
    std::fill_n(node_of.begin() + super[k], node.n_columns, k);
  }
  for (int k = 0; k < int(nodes_.size()); ++k) {
    Node& node = nodes_[k];
    node.parent = node.n_below() > 0 ? node_of[rows_[node.rows + node.n_columns]] : -1;
    if (node.parent >= 0) nodes_[node.parent].children.push_back(k);
  }
  for (const Node& node : nodes_) {
    for (int row = 0; row < node.n_rows; ++row) place[rows_[node.rows + row]] = row;
    for (const int child : node.children) {
      const Node& below = nodes_[child];
      for (int row = below.n_columns; row < below.n_rows; ++row)
        in_parent_[below.rows + row] = place[rows_[below.rows + row]];
    }
  }
  find_branches();

  std::vector<int> place_of(n_);  // in L
  for (std::size_t k = 0; k < n_; ++k) place_of[order[k]] = int(k);
  std::vector<std::size_t> n_entries(nodes_.size() + 1, 0);
  const auto for_each_entry = [&](const auto& call) {
    for (int j = 0; j < A.outerSize(); ++j)
      for (int at = A.outerIndexPtr()[j]; at < A.outerIndexPtr()[j + 1]; ++at) {
        if (A.innerIndexPtr()[at] < j) continue;
        const auto [column, row] = std::minmax(place_of[j], place_of[A.innerIndexPtr()[at]]);
        call(at, column, row);
      }
  };
  for_each_entry([&](int, int column, int) { ++n_entries[node_of[column] + 1]; });
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    nodes_[k].entries = n_entries[k];
    n_entries[k + 1] += n_entries[k];
  }
  entries_.resize(n_entries.back());
  for_each_entry([&](int at, int column, int row) {
    const Node& node = nodes_[node_of[column]];
    const auto begin = rows_.begin() + std::ptrdiff_t(node.rows);
    const auto in_block = int(std::lower_bound(begin, begin + node.n_rows, row) - begin);
    entries_[n_entries[node_of[column]]++] = {
        at, (column - node.first_column) * node.n_rows + in_block};
  });
}

/// The nodes are in postorder: a branch is a range of them.
void SupernodeTree::find_branches() {
  std::vector<double> of_branch(nodes_.size(), 0);
  double all = 0;
  for (int k = 0; k < int(nodes_.size()); ++k) {
    Node& node = nodes_[k];
    node.first = node.children.empty() ? k : nodes_[node.children.front()].first;
    const double own = operations(node.n_columns, node.n_below());
    all += own;
    of_branch[k] += own;
    if (node.parent >= 0) of_branch[node.parent] += of_branch[k];
  }
  for (Node& node : nodes_) {
    const double of_it = of_branch[std::size_t(&node - nodes_.data())];
    node.is_branch = node.children.empty() || of_it <= std::max(kBranchShare * all, kBranchLeast);
    node.is_large = !node.is_branch && operations(node.n_columns, node.n_below()) > kLarge;
  }
}

/// Each node after those below it.
void SupernodeTree::up(const std::function<void(int)>& visit) const {
  std::vector<std::atomic<int>> awaited(nodes_.size());
  for (std::size_t k = 0; k < nodes_.size(); ++k) awaited[k] = int(nodes_[k].children.size());
  tbb::task_group tasks;
  for (int k = 0; k < int(nodes_.size()); ++k) {
    const int parent = nodes_[k].parent;
    if (!nodes_[k].is_branch || (parent >= 0 && nodes_[parent].is_branch)) continue;
    tasks.run([&, k] {
      {
        const OneBlasThread one;
        for (int each = nodes_[k].first; each <= k; ++each) visit(each);
      }
      for (int above = nodes_[k].parent; above >= 0 && --awaited[above] == 0;
           above = nodes_[above].parent)
        visit(above);
    });
  }
  finish(tasks);
}

/// Each node before those below it.
void SupernodeTree::down(const std::function<void(int)>& visit) const {
  tbb::task_group tasks;
  const std::function<void(int)> start = [&](int k) {
    tasks.run([&, k] {
      if (nodes_[k].is_branch) {
        const OneBlasThread one;
        for (int each = k; each >= nodes_[k].first; --each) visit(each);
        return;
      }
      visit(k);
      for (const int child : nodes_[k].children) start(child);
    });
  };
  for (int k = 0; k < int(nodes_.size()); ++k)
    if (nodes_[k].parent < 0) start(k);
  finish(tasks);
}

bool SupernodeTree::factor(const Eigen::SparseMatrix<double>& A, double* L) const {
  if (!std::equal(begins_.begin(), begins_.end(), A.outerIndexPtr(),
                  A.outerIndexPtr() + A.outerSize() + 1) ||
      !std::equal(nonzeros_.begin(), nonzeros_.end(), A.innerIndexPtr()))
    throw std::logic_error("SparseCholesky: the matrix has not the nonzeros of the pattern");
  std::vector<std::vector<double>> updates(nodes_.size());  // lower triangles, column by column
  std::atomic<bool> is_definite = true;
  up([&](int k) {
    const Node& node = nodes_[k];
    std::optional<OneBlasThread> one;
    if (node.is_by_itself()) one.emplace();
    const int m = node.n_columns, n_rows = node.n_rows, n_below = node.n_below();
    double* const block = L + node.values;
    std::fill_n(block, std::size_t(m) * n_rows, 0.0);
    const std::size_t end = k + 1 < int(nodes_.size()) ? nodes_[k + 1].entries : entries_.size();
    for (std::size_t entry = node.entries; entry < end; ++entry)
      block[entries_[entry].to] = A.valuePtr()[entries_[entry].from];
    std::vector<double>& update = updates[k];
    update.assign(std::size_t(n_below) * n_below, 0.0);
    for (const int child : node.children) {
      take_up(nodes_[child], updates[child], node, block, update.data());
      std::vector<double>().swap(updates[child]);
    }
    const bool is_factored =
        node.is_large ? factor_large_block(m, n_rows, block) : factor_block(m, n_rows, block);
    if (!is_factored) is_definite = false;
    if (n_below == 0 || !is_definite) return;
    if (node.is_large) {
      for_lower_tiles(n_below, n_below, [&](int row, int n_in_rows, int column, int n_in_columns) {
        subtract(row == column, n_in_rows, n_in_columns, m, block + m + row, block + m + column,
                 n_rows, update.data() + std::size_t(column) * n_below + row, n_below);
      });
    } else {
      subtract(true, n_below, n_below, m, block + m, block + m, n_rows, update.data(), n_below);
    }
  });
  return is_definite;
}

/// Adds a child's update matrix to the block of its parent and what that leaves itself. No two of
/// its columns go to the same one.
void SupernodeTree::take_up(const Node& child, const std::vector<double>& update, const Node& node,
                            double* block, double* own_update) const {
  const int m = node.n_columns, n = child.n_below();
  const int* to_row = in_parent_.data() + child.rows + child.n_columns;
  const auto take_columns = [&](int first, int n_columns) {
    for (int j = first; j < first + n_columns; ++j) {
      const double* from = update.data() + std::size_t(j) * n;
      const int column = to_row[j];
      double* const to = column < m ? block + std::size_t(column) * node.n_rows
                                    : own_update + std::size_t(column - m) * node.n_below() - m;
      for (int i = j; i < n; ++i) to[to_row[i]] += from[i];
    }
  };
  if (node.is_large)
    for_tiles(n, take_columns);
  else
    take_columns(0, n);
}

/// Block by block from the last: with L = (L_JJ, 0; L_RJ, .) and Y = L_RJ L_JJ^-1,
/// Z_RJ = -Z_RR Y, Z_JJ = L_JJ^-T L_JJ^-1 - Y^T Z_RJ, on the nonzeros of L.
Eigen::VectorXd SupernodeTree::inverse_diagonal(const double* L) const {
  std::vector<double> Z(n_values_);
  Eigen::VectorXd out(static_cast<Eigen::Index>(n_));
  std::vector<int> node_of(n_);
  for (int k = 0; k < int(nodes_.size()); ++k)
    std::fill_n(node_of.begin() + nodes_[k].first_column, nodes_[k].n_columns, k);
  tbb::enumerable_thread_specific<std::vector<int>> places(std::vector<int>(n_, 0));

  // Z_RR, its lower triangle, from the blocks that are found.
  const auto below = [&](const Node& node) {
    std::vector<int>& place = places.local();
    const int* R = rows_.data() + node.rows + node.n_columns;
    const int n = node.n_below();
    Eigen::MatrixXd Z_RR(n, n);
    for (int first = 0; first < n;) {
      const int k = node_of[R[first]];
      const Node& later = nodes_[k];
      for (int row = 0; row < later.n_rows; ++row) place[rows_[later.rows + row]] = row;
      int column = first;
      for (; column < n && node_of[R[column]] == k; ++column) {
        const double* from =
            Z.data() + later.values + std::size_t(R[column] - later.first_column) * later.n_rows;
        for (int row = column; row < n; ++row) Z_RR(row, column) = from[place[R[row]]];
      }
      first = column;
    }
    return Z_RR;
  };
  down([&](int k) {
    const Node& node = nodes_[k];
    std::optional<OneBlasThread> one;
    if (node.is_by_itself()) one.emplace();
    const int m = node.n_columns, n_below = node.n_below();
    const auto for_columns = [&](const auto& f) {
      if (node.is_large)
        for_tiles(m, f);
      else
        f(0, m);
    };
    const Eigen::Map<const Eigen::MatrixXd> block(L + node.values, node.n_rows, m);
    Eigen::Map<Eigen::MatrixXd> found(Z.data() + node.values, node.n_rows, m);
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(m, m);
    for_columns([&](int first, int n) {
      const int left = m - first;  // rows that are not 0
      inverse.block(first, first, left, n) = block.block(first, first, left, left)
                                                 .triangularView<Eigen::Lower>()
                                                 .solve(Eigen::MatrixXd::Identity(left, n));
    });
    for_columns([&](int first, int n) {
      found.block(0, first, m, n).noalias() = inverse.transpose() * inverse.middleCols(first, n);
    });
    if (n_below > 0) {
      Eigen::MatrixXd Y(n_below, m);
      for_columns([&](int first, int n) {
        Y.middleCols(first, n).noalias() = block.bottomRows(n_below) * inverse.middleCols(first, n);
      });
      const Eigen::MatrixXd Z_RR = below(node);
      for_columns([&](int first, int n) {
        cblas_dsymm(CblasColMajor, CblasLeft, CblasLower, n_below, n, -1, Z_RR.data(), n_below,
                    Y.data() + std::size_t(first) * n_below, n_below, 0,
                    found.data() + std::size_t(first) * node.n_rows + m, node.n_rows);
        found.block(0, first, m, n).noalias() -= Y.transpose() * found.block(m, first, n_below, n);
      });
    }
    for (int j = 0; j < m; ++j) out[node.first_column + j] = found(j, j);
  });
  return out;
}

}  // namespace surf
