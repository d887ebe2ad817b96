#include "libsurf/energy/boundary_integral.h"

#include "libsurf/energy/fields.h"
#include "libsurf/fem/stiffness.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(BoundaryTerm);

TYPED_TEST(BoundaryTerm, OfOneIsTheMeasureWithTheStiffnessTimesPositionsAsDerivative) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  BoundaryIntegral<Dim> J(constant_field<Dim>(1));
  J.reset(shape);
  EXPECT_NEAR(J.value(), shape.measure(), 1e-13);
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::no_curvature(shape.n_vertices()), 3, terms);
  const Points<Dim> expected =
      3 * (fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())) * shape.points());
  EXPECT_LT((terms.derivative - expected).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((terms.g.array() - 3).abs().maxCoeff(), 1e-13);
  EXPECT_LT((terms.alpha.array() - 3).abs().maxCoeff(), 1e-13);
  EXPECT_EQ(terms.beta.norm(), 0);
}

// beta = d_nunu H + 2 kappa d_nu H for H = |x|^2 / 2 on the unit sphere: 1 + 2 kappa.
template <int Dim>
class HalfSquare : public Field<Dim> {
 public:
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    out.value = x.rowwise().squaredNorm() / 2;
    if (order >= Derivatives::kFirst) out.gradient = x;
    if (order < Derivatives::kSecond) return;
    const Eigen::Matrix<double, Dim, Dim> one = Eigen::Matrix<double, Dim, Dim>::Identity();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      out.hessian.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, Dim * Dim>>(one.data());
  }
};

TYPED_TEST(BoundaryTerm, HasTheScalarProductWeightsOfItsSecondDerivative) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(Dim == 2 ? 5 : 4);
  BoundaryIntegral<Dim> J(std::make_shared<const HalfSquare<Dim>>());
  J.reset(shape);
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::unit_curvature<Dim>(shape.n_vertices()), 1, terms);
  constexpr double kTolerance = 0.02;  // quadrature points lie h^2 / 8 inside the sphere
  EXPECT_LT((terms.g.array() - 0.5).abs().maxCoeff(), kTolerance);
  EXPECT_LT((terms.alpha.array() - 0.5).abs().maxCoeff(), kTolerance);
  EXPECT_LT((terms.beta.array() - (1 + 2 * (Dim - 1))).abs().maxCoeff(), 4 * kTolerance);
}

TYPED_TEST(BoundaryTerm, IsComputedAnewWhenTheMeshChanges) {
  constexpr int Dim = TypeParam::value;
  const auto coarse = test::unit_sphere<Dim>(2), fine = test::unit_sphere<Dim>(3);
  BoundaryIntegral<Dim> J(constant_field<Dim>(1)), fresh(constant_field<Dim>(1));
  J.reset({coarse.X, coarse.T});
  J.remesh({fine.X, fine.T});
  fresh.reset({fine.X, fine.T});
  EXPECT_EQ(J.value(), fresh.value());
}

}  // namespace
}  // namespace surf::energy
