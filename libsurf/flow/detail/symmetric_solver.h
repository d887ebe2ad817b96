// Direct solution of symmetric systems, and the matrix of fourth-order terms.
#pragma once

#include <memory>

#include "libsurf/fem/geometry.h"

namespace surf::flow {

/// Factors a symmetric matrix, definite or quasi-definite ((B, C), (C^T, -D) with B and D positive
/// semi-definite), as LDL^T with a fill-reducing order.
///
/// A shift of 1e-11 of the diagonal keeps pivots of semi-definite blocks off 0; the solution is
/// refined to the matrix as it is.
class SymmetricSolver {
 public:
  explicit SymmetricSolver(const SparseMatrix& matrix);
  ~SymmetricSolver();
  SymmetricSolver(SymmetricSolver&&) noexcept;
  SymmetricSolver& operator=(SymmetricSolver&&) noexcept;

  /// NaN if a pivot was 0 all the same.
  /// @param n_refinements  each a further solve
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs, int n_refinements = 2) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A M^-1 diag(c) A with lumped masses: int c Lap V Lap W of the mixed form, in which z = -c Lap V
/// is an unknown of its own, <z / c, q> = <grad V, grad q>, eliminated.
/// @param A  fem::stiffness(shape, 1)
/// @param c  at the vertices, (n); its positive part is taken
template <int Dim>
SparseMatrix bilaplacian_matrix(const fem::Geometry<Dim>& shape, const SparseMatrix& A,
                                const Eigen::VectorXd& c);

}  // namespace surf::flow
