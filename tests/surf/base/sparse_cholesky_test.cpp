#include "libsurf/base/sparse_cholesky.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <array>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace surf {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// The graph Laplacian of a grid of n x n nodes with random weights, squared, plus a shift.
Sparse squared_laplacian(int n, unsigned seed, double shift) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> weight(0.5, 2);
  std::vector<Eigen::Triplet<double>> entries;
  const auto join = [&](int a, int b) {
    const double w = weight(random);
    entries.emplace_back(a, a, w);
    entries.emplace_back(b, b, w);
    entries.emplace_back(a, b, -w);
    entries.emplace_back(b, a, -w);
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      if (i + 1 < n) join(i * n + j, (i + 1) * n + j);
      if (j + 1 < n) join(i * n + j, i * n + j + 1);
    }
  Sparse A(n * n, n * n), identity(n * n, n * n);
  A.setFromTriplets(entries.begin(), entries.end());
  identity.setIdentity();
  return Sparse(A * A) + shift * identity;
}

TEST(SparseCholesky, SolvesAsTheDenseInverse) {
  const Sparse A = squared_laplacian(17, 1, 0.01);
  const SparseCholesky factor(A);
  ASSERT_TRUE(factor.is_definite());
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(A).inverse();
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Random(A.rows(), 3);
  EXPECT_LT((factor.solve(rhs) - inverse * rhs).norm(), 1e-10 * (inverse * rhs).norm());
  EXPECT_LT((factor.inverse_diagonal() - inverse.diagonal()).norm(),
            1e-10 * inverse.diagonal().norm());
}

TEST(SparseCholesky, OnePatternServesManyMatrices) {
  const Sparse first = squared_laplacian(20, 1, 0.01), second = squared_laplacian(20, 2, 1);
  const CholeskyPattern pattern(first);
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(first.rows(), -1, 1);
  for (const Sparse& A : {first, second}) {
    const SparseCholesky factor(pattern, A);
    EXPECT_LT((A * factor.solve(rhs) - rhs).norm(), 1e-9 * rhs.norm());
    EXPECT_LT((factor.inverse_diagonal() - Eigen::MatrixXd(A).inverse().diagonal()).norm(), 1e-8);
  }
}

// A BLAS that is built for one thread (libopenblas0-serial) made factors that are not definite.
TEST(SparseCholesky, SeveralThreadsHaveTheirOwn) {
  const Sparse A = squared_laplacian(60, 1, 0.01);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Ones(A.rows(), 20);
  const Eigen::MatrixXd expected = SparseCholesky(A).solve(rhs);
  std::array<bool, 4> are_same{};
  std::vector<std::thread> threads;
  for (bool& is_same : are_same)
    threads.emplace_back([&] {
      is_same = true;
      for (int k = 0; k < 5; ++k) is_same = is_same && SparseCholesky(A).solve(rhs) == expected;
    });
  for (std::thread& thread : threads) thread.join();
  for (const bool is_same : are_same) EXPECT_TRUE(is_same);
}

// Large enough for many branches of the tree, for blocks above them, and for some that are dealt
// out to all cores.
class SparseCholeskyOfSize : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, SparseCholeskyOfSize, ::testing::Values(70, 190));

TEST_P(SparseCholeskyOfSize, IsTheSameForAnyNumberOfThreads) {
  const Sparse A = squared_laplacian(GetParam(), 3, 0.01);
  const Eigen::MatrixXd rhs = Eigen::MatrixXd::Identity(A.rows(), 12);
  const auto solved = [&](int n_threads) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                      std::size_t(n_threads));
    return tbb::task_arena(n_threads).execute([&] {
      const SparseCholesky factor(A);
      return std::pair(factor.solve(rhs), factor.inverse_diagonal());
    });
  };
  const auto [X, diagonal] = solved(1);
  EXPECT_LT((A * X - rhs).norm(), 1e-9 * rhs.norm());
  for (int i = 0; i < rhs.cols(); ++i) EXPECT_NEAR(diagonal[i], X(i, i), 1e-9 * X(i, i));
  for (const int n_threads : {2, 5}) {
    const auto [Y, again] = solved(n_threads);
    EXPECT_EQ(X, Y);
    EXPECT_EQ(diagonal, again);
  }
}

TEST(SparseCholesky, ForestsHaveFactorsToo) {
  const Sparse one = squared_laplacian(12, 1, 0.01);
  const auto n = one.rows();
  std::vector<Eigen::Triplet<double>> entries;
  for (const int part : {0, 1, 2})
    for (int j = 0; j < one.outerSize(); ++j)
      for (Sparse::InnerIterator entry(one, j); entry; ++entry)
        entries.emplace_back(part * n + entry.row(), part * n + j, entry.value());
  Sparse A(3 * n + 1, 3 * n + 1);
  entries.emplace_back(3 * n, 3 * n, 4);  // and a node by itself
  A.setFromTriplets(entries.begin(), entries.end());
  const SparseCholesky factor(A);
  ASSERT_TRUE(factor.is_definite());
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
  EXPECT_LT((A * factor.solve(rhs) - rhs).norm(), 1e-9 * rhs.norm());
  EXPECT_NEAR(factor.inverse_diagonal()[3 * n], 0.25, 1e-15);
}

TEST(SparseCholesky, RefusesAMatrixOfOtherNonzeros) {
  const CholeskyPattern pattern(squared_laplacian(8, 1, 1));
  EXPECT_THROW(SparseCholesky(pattern, squared_laplacian(9, 1, 1)), std::logic_error);
  // As many, but elsewhere.
  Sparse A(2, 2), B(2, 2);
  A.insert(0, 0) = A.insert(1, 0) = 1;
  B.insert(0, 0) = B.insert(1, 1) = 1;
  A.makeCompressed();
  B.makeCompressed();
  EXPECT_THROW(SparseCholesky(CholeskyPattern(A), B), std::logic_error);
}

TEST(SparseCholesky, TheMemoryOfOneWithoutAFactorServesTheNext) {
  const Sparse bad = squared_laplacian(20, 1, -10), good = squared_laplacian(20, 2, 1);
  const CholeskyPattern pattern(bad);
  EXPECT_FALSE(SparseCholesky(pattern, bad).is_definite());
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(good.rows(), -1, 1);
  const Eigen::MatrixXd fresh = SparseCholesky(good).solve(rhs);
  EXPECT_EQ(SparseCholesky(pattern, good).solve(rhs), fresh);
  const SparseCholesky first(pattern, good), second(pattern, squared_laplacian(20, 3, 1));
  EXPECT_EQ(first.solve(rhs), fresh);  // both at once do not share it
}

TEST(SparseCholesky, SaysWhereThereIsNoFactor) {
  const Sparse A = squared_laplacian(5, 1, -10);
  const SparseCholesky factor(A);
  EXPECT_FALSE(factor.is_definite());
  EXPECT_THROW(factor.solve(Eigen::VectorXd::Ones(25)), std::logic_error);
  EXPECT_THROW(factor.inverse_diagonal(), std::logic_error);
}

}  // namespace
}  // namespace surf
