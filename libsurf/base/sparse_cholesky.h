// Cholesky factors of sparse symmetric positive definite matrices.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>

namespace surf {

/// What the factors of all matrices with the same nonzeros share: an order of little fill, the
/// nonzeros of the factor, and the memory of those that are gone.
class CholeskyPattern {
 public:
  /// @param matrix  (n, n), symmetric; of its values only the places count
  explicit CholeskyPattern(const Eigen::SparseMatrix<double>& matrix);

 private:
  friend class SparseCholesky;
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// A = P^T L L^T P: order, nonzeros and solving by CHOLMOD, the values on all cores
/// (detail/supernodes.h). By dense blocks of columns it is 6 times as fast as Eigen::SimplicialLDLT
/// on A M A of a surface of 40,000 vertices, 10 times on 90,000, on one core already. What a member
/// returns does not depend on threads; no two may use an object at once.
class SparseCholesky {
 public:
  /// @param matrix  (n, n), symmetric; its lower triangle is read
  explicit SparseCholesky(const Eigen::SparseMatrix<double>& matrix);
  /// @param pattern  of a matrix with the same nonzeros; else std::logic_error
  SparseCholesky(const CholeskyPattern& pattern, const Eigen::SparseMatrix<double>& matrix);
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;
  ~SparseCholesky();

  /// Whether the matrix is positive definite; else nothing can be solved.
  bool is_definite() const;
  /// A^-1 B, (n, columns). Throws std::logic_error if not is_definite().
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rhs) const;
  /// The diagonal of A^-1, (n): Takahashi's recursion, block by block, exact. About the time of the
  /// factorisation.
  Eigen::VectorXd inverse_diagonal() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf
