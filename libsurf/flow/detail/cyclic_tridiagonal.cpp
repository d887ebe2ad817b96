#include "libsurf/flow/detail/cyclic_tridiagonal.h"

#include <vector>

namespace surf::flow {
namespace {

/// One polygon in the order of its nodes: entries of row k with nodes k - 1, k and k + 1. Without
/// those of the first with the last and of the last with the first if it is open.
struct Chain {
  bool is_open = false;
  std::vector<int> nodes;
  std::vector<double> before, diagonal, after;
};

/// The neighbour of `row` that is not `other`; -1 if there is none.
int step_from(const SparseMatrix& matrix, int row, int other) {
  int found = -1;
  for (SparseMatrix::InnerIterator entry(matrix, row); entry; ++entry)
    if (entry.col() != row && entry.col() != other) found = static_cast<int>(entry.col());
  return found;
}

/// An end of the open polygon that holds a node; of a closed one the node.
int end_of(const SparseMatrix& matrix, int node) {
  for (int before = -1, at = node;;) {
    const int next = step_from(matrix, at, before);
    if (next < 0 || next == node) return next < 0 ? at : node;
    before = at;
    at = next;
  }
}

Chain chain_from(const SparseMatrix& matrix, int node) {
  Chain out;
  const int first = end_of(matrix, node), one = step_from(matrix, first, -1),
            other = one < 0 ? -1 : step_from(matrix, first, one);
  out.is_open = other < 0;
  const int last = out.is_open ? -1 : one;
  for (int before = last, at = first; at >= 0;) {
    out.nodes.push_back(at);
    out.before.push_back(0);
    out.diagonal.push_back(0);
    out.after.push_back(0);
    for (SparseMatrix::InnerIterator entry(matrix, at); entry; ++entry)
      (entry.col() == at       ? out.diagonal
       : entry.col() == before ? out.before
                               : out.after)
          .back() = entry.value();
    if (at == last) break;
    const int next = step_from(matrix, at, before);
    before = at;
    at = next;
  }
  return out;
}

/// Sherman and Morrison: the two corners of the matrix are a term of rank one. Overwrites the rows.
void solve(Chain& rows, Eigen::VectorXd& x) {
  const std::size_t n = rows.nodes.size();
  const double shift = rows.is_open ? 0 : -rows.diagonal[0], corner = rows.before[0],
               other = rows.after[n - 1];
  std::vector<double> y(n), u(n, 0);
  for (std::size_t k = 0; k < n; ++k) y[k] = x[rows.nodes[k]];
  if (!rows.is_open) {
    rows.diagonal[0] -= shift;
    rows.diagonal[n - 1] -= corner * other / shift;
    u[0] = shift;
    u[n - 1] = other;
  }
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
  const double at_corner = rows.is_open ? 0 : corner / shift;
  const double share = (y[0] + at_corner * y[n - 1]) / (1 + u[0] + at_corner * u[n - 1]);
  for (std::size_t k = 0; k < n; ++k) x[rows.nodes[k]] = y[k] - share * u[k];
}

}  // namespace

Eigen::VectorXd solve_cyclic_tridiagonal(const SparseMatrix& matrix, const Eigen::VectorXd& rhs) {
  Eigen::VectorXd x = rhs;
  std::vector<char> is_done(rhs.size(), 0);
  for (int first = 0; first < rhs.size(); ++first) {
    if (is_done[first]) continue;
    Chain rows = chain_from(matrix, first);
    for (const int node : rows.nodes) is_done[node] = 1;
    solve(rows, x);
  }
  return x;
}

}  // namespace surf::flow
