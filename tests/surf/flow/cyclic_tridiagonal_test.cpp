#include "libsurf/flow/detail/cyclic_tridiagonal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <random>

namespace surf::flow {
namespace {

/// Random rows, diagonally dominant, of polygons with these numbers of nodes, numbered at random.
/// Negative: open.
SparseMatrix random_matrix(const std::vector<int>& polygons, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.5, 1);
  const int n = std::accumulate(polygons.begin(), polygons.end(), 0,
                                [](int sum, int size) { return sum + std::abs(size); });
  std::vector<int> number(n);
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), random);
  std::vector<Eigen::Triplet<double>> entries;
  int first = 0;
  for (const int with_sign : polygons) {
    const int size = std::abs(with_sign);
    for (int k = 0; k < size; ++k) {
      const int at = number[first + k];
      entries.emplace_back(at, at, 2 + uniform(random));
      for (const int step : {1, size - 1}) {
        if (with_sign < 0 && k == (step == 1 ? size - 1 : 0)) continue;
        entries.emplace_back(at, number[first + (k + step) % size], -uniform(random));
      }
    }
    first += size;
  }
  SparseMatrix out(n, n);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

TEST(CyclicTridiagonal, SolvesSeveralPolygonsOpenAndClosedNumberedInAnyWay) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const SparseMatrix matrix = random_matrix({3, 4, -5, 40, 3, -3, -17}, seed);
    const Eigen::VectorXd wanted = Eigen::VectorXd::LinSpaced(matrix.rows(), -1, 2);
    const Eigen::VectorXd found = solve_cyclic_tridiagonal(matrix, matrix * wanted);
    // Condition number at most (3 + 2) / (2.5 - 2) or so.
    EXPECT_LE((found - wanted).cwiseAbs().maxCoeff(), 1e-13);
  }
}

}  // namespace
}  // namespace surf::flow
