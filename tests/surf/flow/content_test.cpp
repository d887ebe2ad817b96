#include "libsurf/flow/content.h"

#include "tests/surf/fixtures.h"

namespace surf::flow {
namespace {

IN_BOTH_DIMENSIONS(Content);

TYPED_TEST(Content, IsThatOfTheGeometryAndItsGradientLumpedMassTimesNodalNormal) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(1, 3);
  constexpr double kRounding = 1e-13;
  EXPECT_NEAR(content<Dim>(shape.points(), shape.elements()), shape.enclosed(),
              kRounding * shape.enclosed());
  const Points<Dim> expected = shape.lumped_mass().asDiagonal() * shape.nodal_normals();
  EXPECT_LT((content_gradient<Dim>(shape.points(), shape.elements()) - expected).norm(),
            kRounding * expected.norm());
}

TYPED_TEST(Content, HasTheGradientOfItsDifferences) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::rough_sphere<Dim>(2);
  const Points<Dim> W = test::random_smooth_vectors<Dim>(arrays.X, 3);
  constexpr double kStep = 1e-5;
  const double fd = (content<Dim>(arrays.X + kStep * W, arrays.T) -
                     content<Dim>(arrays.X - kStep * W, arrays.T)) /
                    (2 * kStep);
  EXPECT_NEAR(content_gradient<Dim>(arrays.X, arrays.T).cwiseProduct(W).sum(), fd,
              1e-8 * std::abs(fd));
}

TYPED_TEST(Content, IsCorrectedToRoundingAtAnyScaleAndPlace) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(4, 3);
  for (const double scale : {1e-3, 1.0, 1e3})
    for (const double share : {0.7, 0.999, 1.0001, 1.5}) {
      Points<Dim> X =
          (scale * arrays.X).rowwise() + scale * Vector<Dim>::LinSpaced(-30, 80).transpose();
      const fem::Geometry<Dim> shape(X, arrays.T);
      const double target = share * shape.enclosed();
      EXPECT_TRUE(correct_content<Dim>(X, arrays.T, shape.nodal_normals(), target, scale));
      EXPECT_NEAR(fem::Geometry<Dim>(X, arrays.T).enclosed(), target, 1e-13 * target);
    }
}

TYPED_TEST(Content, IsChangedNoFurtherThanTheLongestMoveAllows) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(3);
  Points<Dim> X = shape.points();
  EXPECT_FALSE(correct_content<Dim>(X, shape.elements(), shape.nodal_normals(), 100, 0.05));
  EXPECT_NEAR((X - shape.points()).rowwise().norm().maxCoeff(), 0.05, 1e-15);
  X = shape.points();
  EXPECT_FALSE(
      correct_content<Dim>(X, shape.elements(), Points<Dim>::Zero(X.rows(), Dim), 100, 0.05));
  EXPECT_EQ(X, shape.points());
}

TYPED_TEST(Content, LeavesTheShapeWhereTheDirectionDoesNotChangeIt) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(4, 3);
  Points<Dim> X = arrays.X;
  Points<Dim> translation = Points<Dim>::Zero(X.rows(), Dim);
  translation.col(0).setOnes();
  EXPECT_FALSE(correct_content<Dim>(X, arrays.T, translation, 100, 0.05));
  EXPECT_EQ(X, arrays.X);
}

}  // namespace
}  // namespace surf::flow
