// The blocks of columns of a sparse Cholesky factor, up and down their tree, on all cores.
#pragma once

#include <cholmod.h>

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <functional>
#include <vector>

namespace surf {

/// What the supernodal factors L L^T = P A P^T of all matrices with the same nonzeros share. A
/// block of columns changes those above it in the elimination tree alone: each branch has a thread
/// of its own, so that what members return does not depend on how many there are.
class SupernodeTree {
 public:
  /// @param L  CHOLMOD's supernodal analysis of A
  /// @param A  (n, n), compressed; its lower triangle is read
  SupernodeTree(const cholmod_factor& L, const Eigen::SparseMatrix<double>& A);

  /// The values of L, where CHOLMOD has them, by the multifrontal method (J. W. H. Liu, The
  /// multifrontal method for sparse matrix solution: theory and practice, SIAM Review 34, 1992):
  /// a block takes up the update matrices of its children in the tree and leaves its own. Half the
  /// time of CHOLMOD's on one thread, which calls BLAS for every two blocks that meet.
  /// @param A  compressed, of the same nonzeros: else std::logic_error
  /// @return   false if it is not positive definite
  bool factor(const Eigen::SparseMatrix<double>& A, double* L) const;

  /// The diagonal of (L L^T)^-1, (n), in the order of L; Takahashi's recursion.
  Eigen::VectorXd inverse_diagonal(const double* L) const;

 private:
  struct Node {
    int first_column, n_columns;
    int n_rows;           ///< those of its own columns first
    std::size_t rows;     ///< where they begin in rows_
    std::size_t values;   ///< where its columns begin in the factor, one after the other
    std::size_t entries;  ///< where those of A begin in entries_, up to the next node's
    int parent;           ///< -1: none
    int first;            ///< of its branch, which ends with it
    bool is_branch;       ///< one task has all of it
    bool is_large;        ///< and none of them: its rows and columns are dealt out to all cores
    std::vector<int> children;

    int n_below() const { return n_rows - n_columns; }
    /// Neither a branch nor the tasks that it is dealt out to keep BLAS to their thread.
    bool is_by_itself() const { return !is_branch && !is_large; }
  };
  /// An entry of A: where it is in its values, and where in the block.
  struct Entry {
    int from, to;
  };

  void find_branches();
  void up(const std::function<void(int)>& visit) const;
  void down(const std::function<void(int)>& visit) const;
  void take_up(const Node& child, const std::vector<double>& update, const Node& node,
               double* block, double* own_update) const;

  std::size_t n_, n_values_;
  std::vector<int> begins_, nonzeros_;  ///< of A: columns, and the rows in them
  std::vector<Node> nodes_;
  std::vector<int> rows_;
  std::vector<int> in_parent_;  ///< for each of rows_ below the columns: which row of the parent
  std::vector<Entry> entries_;
};

}  // namespace surf
