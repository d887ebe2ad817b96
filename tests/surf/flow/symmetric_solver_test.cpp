#include "libsurf/flow/detail/symmetric_solver.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/fixtures.h"

namespace surf::flow {
namespace {

IN_BOTH_DIMENSIONS(FourthOrder);

template <int Dim>
SparseMatrix plain_stiffness(const fem::Geometry<Dim>& shape) {
  return fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
}

// x is an eigenfunction of the sphere, Lap x = -(Dim - 1) x: int (Lap x)^2 = (Dim - 1)^2 int x^2.
TYPED_TEST(FourthOrder, MatrixConvergesToTheBilaplacian) {
  constexpr int Dim = TypeParam::value;
  const double exact = Dim == 2 ? std::numbers::pi : 4 * 4 * std::numbers::pi / 3;
  double before = 0;
  for (int level = 2; level < 5; ++level) {
    const auto shape = test::sphere_geometry<Dim>(level);
    const Eigen::VectorXd two = Eigen::VectorXd::Constant(shape.n_vertices(), 2);
    const SparseMatrix K = bilaplacian_matrix<Dim>(shape, plain_stiffness(shape), two);
    const Eigen::VectorXd x = shape.points().col(0);
    const double error = std::abs(x.dot(K * x) / 2 - exact);
    if (level > 2) {
      EXPECT_NEAR(std::log2(before / error), 2, 0.3);
    }
    before = error;
  }
}

// With the shift the second pivot is d - d d / d = 0 to the last bit.
TEST(SymmetricSolver, SolutionIsNaNWhereAPivotIsZero) {
  const double d = 1 + 1e-11;
  SparseMatrix matrix(2, 2);
  matrix.insert(0, 0) = matrix.insert(1, 1) = 1;
  matrix.insert(0, 1) = matrix.insert(1, 0) = d;
  const Eigen::VectorXd x = SymmetricSolver(matrix).solve(Eigen::Vector2d(1, 2), 0);
  EXPECT_TRUE(x.array().isNaN().all()) << x.transpose();
}

TYPED_TEST(FourthOrder, SystemIsSolvedToRounding) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(3, 3);
  SparseMatrix matrix = bilaplacian_matrix<Dim>(shape, plain_stiffness(shape),
                                                Eigen::VectorXd::Ones(shape.n_vertices()));
  matrix.diagonal() += shape.lumped_mass();
  const Eigen::VectorXd rhs = shape.points().col(1);
  const Eigen::VectorXd x = SymmetricSolver(matrix).solve(rhs);
  EXPECT_LT((matrix * x - rhs).norm(), 1e-11 * rhs.norm());
}

// ((A, M), (M, -A)) with the kernel of A in both blocks, and units 1e12 apart.
TYPED_TEST(FourthOrder, SystemWithSemiDefiniteBlocksIsSolvedToRounding) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(5, 2);
  const int n = int(shape.n_vertices());
  const Eigen::MatrixXd A = plain_stiffness(shape).toDense();
  for (const double tau : {1e-6, 1.0, 1e6}) {
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    dense.topLeftCorner(n, n) = tau * A;
    dense.bottomRightCorner(n, n) = -A;
    dense.topRightCorner(n, n) = shape.lumped_mass().asDiagonal();
    dense.bottomLeftCorner(n, n) = shape.lumped_mass().asDiagonal();
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(2 * n);
    rhs.head(n) = shape.points().col(0);
    const SparseMatrix matrix = dense.sparseView();
    const Eigen::VectorXd x = SymmetricSolver(matrix).solve(rhs);
    EXPECT_LT((dense * x - rhs).norm(), 1e-10 * rhs.norm()) << tau;
  }
}

}  // namespace
}  // namespace surf::flow
