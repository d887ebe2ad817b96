#include "libsurf/flow/content.h"

#include "tests/surf/fixtures.h"

namespace surf::flow {
namespace {

using test::DimName;
using test::Dims;

template <class T>
struct Content : ::testing::Test {};
TYPED_TEST_SUITE(Content, Dims, DimName);

TYPED_TEST(Content, IsThatOfTheGeometryAndItsGradientLumpedMassTimesNodalNormal) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(1, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  constexpr double kRounding = 1e-13;
  EXPECT_NEAR(content<Dim>(arrays.X, arrays.T), shape.enclosed(), kRounding * shape.enclosed());
  const Points<Dim> expected = shape.lumped_mass().asDiagonal() * shape.nodal_normals();
  EXPECT_LT((content_gradient<Dim>(arrays.X, arrays.T) - expected).norm(),
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
  const auto arrays = test::unit_sphere<Dim>(3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  Points<Dim> X = arrays.X;
  EXPECT_FALSE(correct_content<Dim>(X, arrays.T, shape.nodal_normals(), 100, 0.05));
  EXPECT_NEAR((X - arrays.X).rowwise().norm().maxCoeff(), 0.05, 1e-15);
  X = arrays.X;
  EXPECT_FALSE(correct_content<Dim>(X, arrays.T, Points<Dim>::Zero(X.rows(), Dim), 100, 0.05));
  EXPECT_EQ(X, arrays.X);
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
