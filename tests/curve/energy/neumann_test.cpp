#include "libcurve/energy/neumann.h"

#include <cmath>
#include <numbers>

#include "libcurve/mesh/primitives.h"
#include "tests/curve/analytic_fields.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

using std::numbers::pi;
constexpr double kMu = TwoSquares::kMu;
constexpr auto kA = TwoSquares::kA, kB = TwoSquares::kB;
constexpr auto exact = TwoSquares::exact;
constexpr auto exact_gradient = TwoSquares::exact_gradient;
constexpr auto image = TwoSquares::image;

Neumann solved(const DomainMesh& mesh, std::shared_ptr<const Field<2>> I,
               const NeumannOptions& options) {
  return {mesh, image_integrals(mesh, *I, options), I, options};
}

Neumann solved(double h) {
  const SizeField sizes(square(2), h, 0.1);
  return solved(mesh_domain(polygon(square(1), h), square(2), sizes), image(),
                {.mu = kMu, .spacing_mm = h / 2});
}

/// In L2 and in the H1 seminorm, over both domains, by the midpoints of the edges.
std::array<double, 2> errors(const Neumann& problem) {
  const DomainMesh& mesh = problem.mesh();
  double value = 0, gradient = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const bool inside = mesh.is_inside[t];
    Eigen::Matrix3d C;  // 1, x, y at the corners
    Eigen::Vector3d u;
    for (int i = 0; i < 3; ++i) {
      C.row(i) << 1, mesh.points.row(mesh.triangles(t, i));
      u[i] = problem.value(mesh.triangles(t, i), inside);
    }
    const double area = C.determinant() / 2;
    const Eigen::Vector3d plane = C.inverse() * u;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d at = (C.row(i) + C.row((i + 1) % 3)) / 2;
      const Vector<2> x = at.tail<2>();
      value += area / 3 * std::pow(plane.dot(at) - exact(x, inside), 2);
      gradient += area / 3 * (plane.tail<2>() - exact_gradient(x, inside)).squaredNorm();
    }
  }
  return {std::sqrt(value), std::sqrt(gradient)};
}

TEST(Neumann, SolutionIsOfSecondOrderInL2AndOfFirstInH1) {
  const auto coarse = errors(solved(0.1)), fine = errors(solved(0.05));
  EXPECT_LT(fine[0], 0.01);
  // Meshes are not nested: the orders scatter by about 0.15.
  EXPECT_NEAR(std::log2(coarse[0] / fine[0]), 2, 0.3);
  EXPECT_NEAR(std::log2(coarse[1] / fine[1]), 1, 0.2);
}

// int_{Omega_i} ((u - I)^2 + mu |grad u|^2) = -2 pi^2 mu (1 + 2 pi^2 mu) a^2 |Omega_i| / 4 less the
// integral of I^2, with mean 1/4 of cos^2 cos^2.
TEST(Neumann, EnergyIsOfSecondOrder) {
  double expected = 0;
  for (int side = 0; side < 2; ++side) {
    const double area = side == 1 ? 4 : 12, k = 1 + 2 * pi * pi * kMu;
    expected += -0.5 * area * (k * kA[side] * kA[side] / 4 + kB[side] * kB[side]);
  }
  const double coarse = solved(0.1).energy() - expected, fine = solved(0.05).energy() - expected;
  EXPECT_GT(fine, 0);  // a minimum over fewer functions
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.3);
}

TEST(Neumann, GradientIsTheDerivativeByEveryNode) {
  const Neumann problem = solved(0.25);
  const Points<2> gradient = problem.gradient();
  constexpr double kStep = 1e-5, kTolerance = 1e-6;
  for (Eigen::Index i = 0; i < problem.mesh().points.rows(); i += 7)
    for (int axis = 0; axis < 2; ++axis) {
      // Nodes on the squares see the jump of I when they move off them.
      if (problem.mesh().is_on_border[i] ||
          std::abs(problem.mesh().points.row(i).cwiseAbs().maxCoeff() - 1) < 0.3)
        continue;
      Points<2> plus = problem.mesh().points, minus = plus;
      plus(i, axis) += kStep;
      minus(i, axis) -= kStep;
      const double difference =
          (problem.moved_to(plus).energy() - problem.moved_to(minus).energy()) / (2 * kStep);
      EXPECT_NEAR(gradient(i, axis), difference, kTolerance) << i;
    }
}

TEST(Neumann, MeansAreThoseOfTheImage) {
  const auto means = solved(0.1).means();
  EXPECT_NEAR(means[0], kB[0], 1e-3);
  EXPECT_NEAR(means[1], kB[1], 1e-3);
}

TEST(Neumann, WarmStartSavesIterations) {
  const Neumann problem = solved(0.05);
  const Neumann again = problem.moved_to(problem.mesh().points);
  EXPECT_GT(problem.n_iterations(), 5);
  EXPECT_LE(again.n_iterations(), 1);
}

// Loads are integrated on parts of the triangles: a coarse mesh sees the mean of a fine pattern.
TEST(Neumann, QuadratureResolvesPixelsOnACoarseMesh) {
  const auto checkerboard = std::make_shared<FormulaField>(
      [](const Vector<2>& x) {
        return (int(std::floor(x[0] * 10)) + int(std::floor(x[1] * 10))) % 2 == 0 ? 1 : 0;
      },
      [](const Vector<2>&) { return Vector<2>::Zero(); });
  const SizeField sizes(square(2), 2, 0.1);
  const Neumann problem = solved(mesh_domain(polygon(square(1), 1), square(2), sizes), checkerboard,
                                 {.mu = 1, .spacing_mm = 0.05});
  EXPECT_LT((problem.u().array() - 0.5).abs().maxCoeff(), 0.02);
}

// Integrals of triangles that an earlier mesh has are copied, whichever corner comes first.
TEST(Neumann, KnownIntegralsAreThoseComputedAnew) {
  const SizeField sizes(square(2), 0.4, 0.1);
  const NeumannOptions options{.mu = kMu, .spacing_mm = 0.05};
  const Segments first = polygon(square(1), 0.3), second = polygon(square(1.1), 0.3);
  const DomainMesh old = mesh_domain(first, square(2), sizes);
  const ImageIntegrals known = image_integrals(old, *image(), options);
  const DomainMesh mesh = mesh_domain(second, square(2), sizes, reusable_nodes(old, second, sizes));
  const ImageIntegrals anew = image_integrals(mesh, *image(), options);
  const ImageIntegrals copied = image_integrals(mesh, *image(), options, &old, &known);
  EXPECT_LT((anew.loads - copied.loads).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((anew.errors - copied.errors).cwiseAbs().maxCoeff(), 1e-15);
}

}  // namespace
}  // namespace surf::curve
