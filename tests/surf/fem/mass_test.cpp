#include "libsurf/fem/mass.h"

#include <Eigen/Cholesky>

#include "libsurf/fem/quadrature.h"
#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

constexpr double kTolerance = 1e-14;  // rounding; masses are below 1

IN_BOTH_DIMENSIONS(Mass);

Eigen::VectorXd random_weights(Eigen::Index n) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(0.1, 2);
  return Eigen::VectorXd::NullaryExpr(n, [&] { return uniform(generator); });
}

/// <w phi_i, phi_j> by quadrature of this order, w given at the element's vertices.
template <int Dim, class Weight>
Eigen::MatrixXd by_quadrature(const Geometry<Dim>& shape, int order, const Weight& weight) {
  const auto& rule = quadrature<Dim>(order);
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(shape.n_vertices(), shape.n_vertices());
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      double w = 0;
      for (int k = 0; k < Dim; ++k) w += rule.points(q, k) * weight(t, k);
      for (int i = 0; i < Dim; ++i)
        for (int j = 0; j < Dim; ++j)
          M(shape.elements()(t, i), shape.elements()(t, j)) +=
              rule.weights[q] * shape.measures()[t] * w * rule.points(q, i) * rule.points(q, j);
    }
  return M;
}

TYPED_TEST(Mass, MatrixHasTheLumpedMassesAsRowSums) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(shape.n_elements());
  const SparseMatrix M = mass<Dim>(shape, one);
  const Eigen::VectorXd sums = M * Eigen::VectorXd::Ones(shape.n_vertices());
  EXPECT_LT((sums - shape.lumped_mass()).cwiseAbs().maxCoeff(), kTolerance);
}

TYPED_TEST(Mass, MatrixIsTheQuadratureOfOrderTwo) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(2);
  const Eigen::VectorXd w = random_weights(shape.n_elements());
  const Eigen::MatrixXd expected =
      by_quadrature<Dim>(shape, 2, [&](Eigen::Index t, int) { return w[t]; });
  const Eigen::MatrixXd M = mass<Dim>(shape, w).toDense();
  EXPECT_LT((M - expected).cwiseAbs().maxCoeff(), kTolerance);
}

TYPED_TEST(Mass, MatrixIsSymmetricAndPositiveDefinite) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(3);
  const Eigen::MatrixXd M = mass<Dim>(shape, random_weights(shape.n_elements())).toDense();
  EXPECT_EQ(M, M.transpose());
  EXPECT_EQ(M.llt().info(), Eigen::Success);
}

TYPED_TEST(Mass, WithNodalWeightIsTheQuadratureOfOrderThree) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(4);
  const Eigen::VectorXd w = random_weights(shape.n_vertices());
  const Eigen::MatrixXd expected = by_quadrature<Dim>(
      shape, 3, [&](Eigen::Index t, int k) { return w[shape.elements()(t, k)]; });
  const Eigen::MatrixXd M = mass_nodal_weight<Dim>(shape, w).toDense();
  EXPECT_LT((M - expected).cwiseAbs().maxCoeff(), kTolerance);
}

TYPED_TEST(Mass, WithNodalWeightAppliedToOneIsTheMassAppliedToTheWeight) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5);
  const Eigen::VectorXd w = random_weights(shape.n_vertices());
  const SparseMatrix M = mass<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const Eigen::VectorXd load =
      mass_nodal_weight<Dim>(shape, w) * Eigen::VectorXd::Ones(shape.n_vertices());
  EXPECT_LT((load - M * w).cwiseAbs().maxCoeff(), kTolerance);
}

}  // namespace
}  // namespace surf::fem
