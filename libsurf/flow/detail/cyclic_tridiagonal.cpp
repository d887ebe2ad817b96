#include "libsurf/flow/detail/cyclic_tridiagonal.h"

#include <cassert>
#include <vector>

namespace surf::flow {
namespace {

/// One polygon in the order of its nodes: entries of row k with nodes k - 1, k and k + 1.
struct Cycle {
  std::vector<int> nodes;
  std::vector<double> before, diagonal, after;
};

/// The neighbour of `row` that is not `other`.
int step_from(const SparseMatrix& matrix, int row, int other) {
  int found = -1;
  for (SparseMatrix::InnerIterator entry(matrix, row); entry; ++entry)
    if (entry.col() != row && entry.col() != other) found = static_cast<int>(entry.col());
  assert(found >= 0 && "a row without two neighbours");
  return found;
}

Cycle cycle_from(const SparseMatrix& matrix, int first) {
  Cycle out;
  const int last = step_from(matrix, first, -1);
  for (int before = last, at = first;;) {
    out.nodes.push_back(at);
    out.before.push_back(0);
    out.diagonal.push_back(0);
    out.after.push_back(0);
    for (SparseMatrix::InnerIterator entry(matrix, at); entry; ++entry)
      (entry.col() == at       ? out.diagonal
       : entry.col() == before ? out.before
                               : out.after)
          .back() = entry.value();
    if (at == last) return out;
    const int next = step_from(matrix, at, before);
    before = at;
    at = next;
  }
}

/// Sherman and Morrison: the two corners of the matrix are a term of rank one. Overwrites the rows.
void solve(Cycle& rows, Eigen::VectorXd& x) {
  const std::size_t n = rows.nodes.size();
  const double shift = -rows.diagonal[0], corner = rows.before[0], other = rows.after[n - 1];
  rows.diagonal[0] -= shift;
  rows.diagonal[n - 1] -= corner * other / shift;
  std::vector<double> y(n), u(n, 0);
  for (std::size_t k = 0; k < n; ++k) y[k] = x[rows.nodes[k]];
  u[0] = shift;
  u[n - 1] = other;
  for (std::size_t k = 0; k < n; ++k) {
    const double left = k > 0 ? rows.before[k] : 0;
    const double pivot = rows.diagonal[k] - (k > 0 ? left * rows.after[k - 1] : 0);
    rows.after[k] /= pivot;
    y[k] = (y[k] - (k > 0 ? left * y[k - 1] : 0)) / pivot;
    u[k] = (u[k] - (k > 0 ? left * u[k - 1] : 0)) / pivot;
  }
  for (std::size_t k = n - 1; k-- > 0;) {
    y[k] -= rows.after[k] * y[k + 1];
    u[k] -= rows.after[k] * u[k + 1];
  }
  const double share = (y[0] + corner / shift * y[n - 1]) / (1 + u[0] + corner / shift * u[n - 1]);
  for (std::size_t k = 0; k < n; ++k) x[rows.nodes[k]] = y[k] - share * u[k];
}

}  // namespace

Eigen::VectorXd solve_cyclic_tridiagonal(const SparseMatrix& matrix, const Eigen::VectorXd& rhs) {
  assert(matrix.nonZeros() == 3 * rhs.size());
  Eigen::VectorXd x = rhs;
  std::vector<char> is_done(rhs.size(), 0);
  for (int first = 0; first < rhs.size(); ++first) {
    if (is_done[first]) continue;
    Cycle rows = cycle_from(matrix, first);
    for (const int node : rows.nodes) is_done[node] = 1;
    solve(rows, x);
  }
  return x;
}

}  // namespace surf::flow
