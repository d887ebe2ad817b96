#include "libsurf/fem/curvature.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

template <int Dim>
Curvature curvature_of(const Geometry<Dim>& shape) {
  return curvature<Dim>(shape, stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())));
}

IN_BOTH_DIMENSIONS(Curvatures);

TYPED_TEST(Curvatures, OfASphereConvergeInTheMean) {
  constexpr int Dim = TypeParam::value;
  constexpr double kRadius = 2;
  const auto error = [&](int level) {
    const auto arrays = test::unit_sphere<Dim>(level);
    const Geometry<Dim> shape(kRadius * arrays.X, arrays.T);
    const auto kappa = curvature_of<Dim>(shape);
    const double square_sum = kappa.square_sum.dot(shape.lumped_mass()) / shape.measure();
    return std::abs(square_sum - (Dim - 1) / (kRadius * kRadius));
  };
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.2);
  EXPECT_LT(error(4), 0.01);
}

// In the mean: at vertices of irregular valence the nodal normals are of lower order.
TYPED_TEST(Curvatures, ShapeOperatorsOfASphereConvergeToTheTangentialIdentityOverTheRadius) {
  constexpr int Dim = TypeParam::value;
  constexpr double kRadius = 2;
  using Matrix = Eigen::Matrix<double, Dim, Dim>;
  const auto error = [&](int level) {
    const auto arrays = test::unit_sphere<Dim>(level);
    const Geometry<Dim> shape(kRadius * arrays.X, arrays.T);
    const auto S = shape_operators<Dim>(shape);
    double sum = 0;
    for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
      const Vector<Dim> nu = shape.normals().row(t);
      const Matrix tangential = Matrix::Identity() - nu * nu.transpose();
      EXPECT_LT((S[t] * nu).norm(), 1e-14) << t;
      EXPECT_EQ(S[t], S[t].transpose()) << t;
      sum += shape.measures()[t] * (S[t] - tangential / kRadius).norm();
    }
    return sum / shape.measure();
  };
  const double coarse = error(4), fine = error(5);
  EXPECT_LT(fine, Dim == 2 ? 1e-12 : 0.6 * coarse);  // regular polygons are exact
  EXPECT_LT(fine, 0.1 / kRadius);
}

// sum m K = 2 pi chi, whatever the mesh: 4 pi for a sphere, 0 for a torus.
TEST(Curvatures, ObeyGaussAndBonnetExactly) {
  const auto twice_total = [](const test::Arrays<3>& arrays) {
    const Geometry<3> shape(arrays.X, arrays.T);
    const auto kappa = curvature_of<3>(shape);
    return (kappa.mean.cwiseAbs2() - kappa.square_sum).dot(shape.lumped_mass());
  };
  EXPECT_NEAR(twice_total(test::rough_sphere<3>(1, 3)), 8 * std::numbers::pi, 1e-11);
  EXPECT_NEAR(twice_total(test::torus(1, 0.4, 24, 12)), 0, 1e-11);
}

TEST(Curvatures, OfACurveHaveOnePrincipalCurvature) {
  const auto arrays = test::random_smooth_shape<2>(1, 3);
  const auto kappa = curvature_of<2>({arrays.X, arrays.T});
  EXPECT_EQ(kappa.square_sum, kappa.mean.cwiseAbs2());
}

}  // namespace
}  // namespace surf::fem
