#include "libsurf/energy/content.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Contents);

TYPED_TEST(Contents, AreTheEnclosedOnesAndHomogeneous) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  Content<Dim> J;
  J.reset(shape);
  EXPECT_EQ(J.value(), shape.enclosed());
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
  EXPECT_NEAR(terms.derivative.cwiseProduct(shape.points()).sum(), Dim * J.value(), 1e-13);
  EXPECT_EQ(terms.g.norm() + terms.alpha.norm() + terms.beta.norm(), 0);
}

// |B_r| = c r^Dim: its second derivative by r is that of |dB_r|.
TYPED_TEST(Contents, OfAGrowingSphereHaveTheSecondDerivativeOfTheMeasure) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(4);
  Content<Dim> J;
  J.reset(shape);
  SecondDerivative<Dim> second(shape);
  J.differentiate_twice(test::unit_curvature<Dim>(shape.n_vertices()), 1, second);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(shape.n_vertices());
  EXPECT_NEAR(one.dot(second.sparse * one), (Dim - 1) * shape.measure(), 1e-12);
}

TYPED_TEST(Contents, HaveTheDensityOne) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(1);
  Content<Dim> J;
  J.reset({arrays.X, arrays.T});
  Eigen::VectorXd density = Eigen::VectorXd::Ones(2);
  J.add_density(Points<Dim>::Zero(2, Dim), 3, density);
  EXPECT_EQ(density, Eigen::Vector2d(4, 4));
}

}  // namespace
}  // namespace surf::energy
