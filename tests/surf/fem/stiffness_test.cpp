#include "libsurf/fem/stiffness.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

IN_BOTH_DIMENSIONS(Stiffness);

template <int Dim>
SparseMatrix plain_stiffness(const Geometry<Dim>& shape) {
  return stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
}

/// Two shapes as one.
template <int Dim>
test::Arrays<Dim> side_by_side(const test::Arrays<Dim>& a, const test::Arrays<Dim>& b) {
  test::Arrays<Dim> both;
  both.X.resize(a.X.rows() + b.X.rows(), Dim);
  both.X << a.X, (b.X.array() + 5.0).matrix();
  both.T.resize(a.T.rows() + b.T.rows(), Dim);
  both.T << a.T, (b.T.array() + static_cast<int>(a.X.rows())).matrix();
  return both;
}

// First variation of length and area: A X = d|Gamma|/dX, exact for any mesh.
TYPED_TEST(Stiffness, TimesPositionsIsTheGradientOfTheMeasure) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(7);
  const Points<Dim> gradient = plain_stiffness<Dim>(shape) * shape.points();
  constexpr double kStep = 1e-5;       // truncation ~ kStep^2 / edge^2
  constexpr double kTolerance = 1e-8;  // rounding ~ eps * measure / kStep
  const auto measure = [](const Geometry<Dim>& moved) { return moved.measure(); };
  test::expect_gradient<Dim>(gradient, shape, measure, kStep, kTolerance);
}

TYPED_TEST(Stiffness, IsSymmetricWithTheConstantsOfEachComponentAsItsKernel) {
  constexpr int Dim = TypeParam::value;
  const auto both = side_by_side<Dim>(test::rough_sphere<Dim>(1, 1), test::rough_sphere<Dim>(2, 1));
  const Geometry<Dim> shape(both.X, both.T);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(0.5, 2);
  const Eigen::VectorXd alpha =
      Eigen::VectorXd::NullaryExpr(shape.n_elements(), [&] { return uniform(generator); });
  const Eigen::MatrixXd A = stiffness<Dim>(shape, alpha).toDense();
  EXPECT_LT((A - A.transpose()).cwiseAbs().maxCoeff(), 1e-14 * A.cwiseAbs().maxCoeff());
  EXPECT_LT(A.rowwise().sum().cwiseAbs().maxCoeff(), 1e-14 * A.cwiseAbs().maxCoeff());
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues();
  EXPECT_LT(std::abs(eigenvalues[0]), 1e-12);
  EXPECT_LT(std::abs(eigenvalues[1]), 1e-12);
  EXPECT_GT(eigenvalues[2], 0.1);  // constants, one per component, and nothing else
}

TYPED_TEST(Stiffness, OfALinearFunctionIsTheIntegralOfItsTangentialGradientSquared) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(4);
  Vector<Dim> a;
  for (int d = 0; d < Dim; ++d) a[d] = 0.3 + d;
  const Eigen::VectorXd alpha = Eigen::VectorXd::LinSpaced(shape.n_elements(), 0.5, 2);
  const Eigen::VectorXd u = shape.points() * a;
  const Eigen::VectorXd normal_part = shape.normals() * a;
  const double expected =
      (alpha.array() * shape.measures().array() * (a.squaredNorm() - normal_part.array().square()))
          .sum();
  EXPECT_NEAR(u.dot(stiffness<Dim>(shape, alpha) * u), expected, 1e-13 * expected);
}

TYPED_TEST(Stiffness, BetweenNormalsIsTheProductOfTheMatricesOfTheSchurComplement) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5);
  const SparseMatrix A = plain_stiffness<Dim>(shape);
  const Eigen::VectorXd inverse_mass = shape.lumped_mass().cwiseInverse();
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(shape.n_vertices(), shape.n_vertices());
  for (int k = 0; k < Dim; ++k) {  // N^k = diag(m_i n_i^k) when lumped
    const Eigen::VectorXd N = shape.lumped_mass().cwiseProduct(shape.nodal_normals().col(k));
    const Eigen::VectorXd scale = inverse_mass.cwiseProduct(N);
    product += scale.asDiagonal() * A.toDense() * scale.asDiagonal();
  }
  const Eigen::MatrixXd S = normal_stiffness<Dim>(shape, A).toDense();
  EXPECT_LT((S - product).cwiseAbs().maxCoeff(), 1e-13 * product.cwiseAbs().maxCoeff());
}

TYPED_TEST(Stiffness, BetweenNormalsIsPositiveSemidefinite) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(6);
  const Eigen::MatrixXd S = normal_stiffness<Dim>(shape, plain_stiffness<Dim>(shape)).toDense();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(S).eigenvalues()[0], -1e-12);
}

/// Relative error of kappa in the L2 norm with lumped masses, against kappa at the vertices.
template <int Dim>
double curvature_error(const Geometry<Dim>& shape, const Eigen::VectorXd& exact) {
  const Eigen::VectorXd kappa = mean_curvature<Dim>(shape, plain_stiffness<Dim>(shape));
  const auto norm = [&](const Eigen::VectorXd& v) {
    return std::sqrt(v.cwiseAbs2().dot(shape.lumped_mass()));
  };
  return norm(kappa - exact) / norm(exact);
}

/// Between successive errors of four levels, each mesh twice as fine; printed as a table.
template <class Error>
void expect_order(const std::string& name, const Error& error, int first_level, double expected,
                  double tolerance) {
  double last = error(first_level);
  std::string line = fmt::format("{:<24}{:.3e}", name, last);
  for (int level = first_level + 1; level < first_level + 4; ++level) {
    const double now = error(level), order = std::log2(last / now);
    EXPECT_NEAR(order, expected, tolerance) << name;
    line += fmt::format("  {:.3e} (order {:.2f})", now, order);
    last = now;
  }
  std::puts(line.c_str());
}

/// Torus with R = 1, r = 0.4: kappa = 1/r + cos(v) / (R + r cos(v)).
constexpr double kTubeRadius = 0.4;
test::Arrays<3> torus_of_level(int level) {
  return test::torus(1, kTubeRadius, 16 << level, 8 << level);
}

double torus_curvature(const Vector<3>& x) {
  const double rho = std::hypot(x[0], x[1]);
  return 1 / kTubeRadius + (rho - 1) / kTubeRadius / rho;
}

Vector<3> torus_normal(const Vector<3>& x) {
  const double rho = std::hypot(x[0], x[1]);
  return (x - Vector<3>(x[0] / rho, x[1] / rho, 0)) / kTubeRadius;
}

Eigen::VectorXd torus_curvatures(const Points<3>& X) {
  Eigen::VectorXd kappa(X.rows());
  for (Eigen::Index i = 0; i < kappa.size(); ++i) kappa[i] = torus_curvature(X.row(i));
  return kappa;
}

/// The torus with its vertices moved on it at random by a fifth of the edge.
test::Arrays<3> rough_torus(int level) {
  auto arrays = torus_of_level(level);
  std::mt19937 generator(9);
  const double edge = 2 * std::numbers::pi * kTubeRadius / (8 << level);
  std::uniform_real_distribution<double> uniform(-0.2 * edge, 0.2 * edge);
  for (Eigen::Index i = 0; i < arrays.X.rows(); ++i) {
    Vector<3> x = arrays.X.row(i);
    for (int d = 0; d < 3; ++d) x[d] += uniform(generator);
    const Vector<3> centre = Vector<3>(x[0], x[1], 0).normalized();
    arrays.X.row(i) = centre + kTubeRadius * (x - centre).normalized();
  }
  return arrays;
}

TEST(MeanCurvature, OfCirclesConvergesWithTheSquareOfTheEdge) {
  const auto error = [](int level) {
    const auto arrays = test::unit_sphere<2>(level);
    return curvature_error<2>(Geometry<2>(3 * arrays.X, arrays.T),
                              Eigen::VectorXd::Constant(arrays.X.rows(), 1 / 3.0));
  };
  expect_order("circle", error, 1, 2, 0.05);
}

// First order in L2: at the six vertices of valence four the lumped kappa is wrong by a constant,
// and each stands for an area of h^2.
TEST(MeanCurvature, OfSpheresConvergesWithTheEdge) {
  const auto error = [](int level) {
    const auto arrays = test::unit_sphere<3>(level);
    return curvature_error<3>(Geometry<3>(arrays.X, arrays.T),
                              Eigen::VectorXd::Constant(arrays.X.rows(), 2));
  };
  expect_order("sphere", error, 2, 1, 0.1);
}

// Every vertex of the torus has valence six and a stencil that is symmetric up to O(h).
TEST(MeanCurvature, OfToriConvergesWithTheSquareOfTheEdge) {
  const auto error = [](int level) {
    const auto arrays = torus_of_level(level);
    return curvature_error<3>(Geometry<3>(arrays.X, arrays.T), torus_curvatures(arrays.X));
  };
  expect_order("torus", error, 0, 2, 0.1);
}

// The curvature vector M^-1 A X itself, not only its normal part.
TEST(MeanCurvature, VectorOfToriConvergesWithTheSquareOfTheEdge) {
  const auto error = [](int level) {
    const auto arrays = torus_of_level(level);
    const Geometry<3> shape(arrays.X, arrays.T);
    const Points<3> load = plain_stiffness<3>(shape) * arrays.X;
    double squared = 0, norm = 0;
    for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
      const Vector<3> exact = torus_curvature(arrays.X.row(i)) * torus_normal(arrays.X.row(i));
      const Vector<3> kappa = load.row(i) / shape.lumped_mass()[i];
      squared += shape.lumped_mass()[i] * (kappa - exact).squaredNorm();
      norm += shape.lumped_mass()[i] * exact.squaredNorm();
    }
    return std::sqrt(squared / norm);
  };
  expect_order("torus, vector", error, 0, 2, 0.15);
}

// On a mesh without structure the lumped kappa does not converge in L2 (it stays 7 % wrong here),
// but its integrals against smooth functions do, which is what the flows use.
TEST(MeanCurvature, OfARoughTorusConvergesWeakly) {
  const auto errors = [](int level) {
    const auto arrays = rough_torus(level);
    const Geometry<3> shape(arrays.X, arrays.T);
    const Eigen::VectorXd kappa = mean_curvature<3>(shape, plain_stiffness<3>(shape));
    const Eigen::VectorXd phi = test::random_smooth_vectors<3>(arrays.X, 3).col(0);
    const Eigen::VectorXd difference = kappa - torus_curvatures(arrays.X);
    return std::abs(shape.lumped_mass().cwiseProduct(phi).dot(difference)) /
           shape.lumped_mass().cwiseProduct(phi.cwiseAbs()).dot(kappa.cwiseAbs());
  };
  expect_order("rough torus, weakly", errors, 0, 2, 0.25);
}

}  // namespace
}  // namespace surf::fem
