#include "libsurf/energy/curvature_density.h"

#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

constexpr double kSpontaneous = 0.7;

template <int Dim>
Points<Dim> some_places() {
  return test::rough_sphere<Dim>(3, 1).X;
}

Eigen::VectorXd some_curvatures(Eigen::Index n) { return Eigen::VectorXd::LinSpaced(n, -2, 3); }

template <int Dim>
CurvatureSamples<Dim> sampled(const Points<Dim>& x, const Eigen::VectorXd& z, Derivatives order) {
  CurvatureSamples<Dim> out;
  squared_curvature<Dim>(std::make_shared<const test::WaveField<Dim>>(5), kSpontaneous)
      ->sample(x, z, order, out);
  return out;
}

IN_BOTH_DIMENSIONS(SquaredCurvature);

TYPED_TEST(SquaredCurvature, IsHalfTheSquareTimesTheField) {
  constexpr int Dim = TypeParam::value;
  const Points<Dim> x = some_places<Dim>();
  const Eigen::VectorXd z = some_curvatures(x.rows());
  Samples<Dim> f;
  test::WaveField<Dim>(5).sample(x, Derivatives::kNone, f);
  const auto H = sampled<Dim>(x, z, Derivatives::kNone);
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    EXPECT_NEAR(H.value[i], f.value[i] * std::pow(z[i] - kSpontaneous, 2) / 2, 1e-14);
}

TYPED_TEST(SquaredCurvature, DerivativesAreThoseOfItsValues) {
  constexpr int Dim = TypeParam::value;
  constexpr double kStep = 1e-5, kTolerance = 1e-8;  // rounding eps |H| / step, truncation step^2
  const Points<Dim> x = some_places<Dim>();
  const Eigen::VectorXd z = some_curvatures(x.rows());
  const auto H = sampled<Dim>(x, z, Derivatives::kSecond);
  const Eigen::VectorXd more = z.array() + kStep, less = z.array() - kStep;
  const auto above = sampled<Dim>(x, more, Derivatives::kFirst),
             below = sampled<Dim>(x, less, Derivatives::kFirst);
  EXPECT_LT((H.dz - (above.value - below.value) / (2 * kStep)).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT((H.dzz - (above.dz - below.dz) / (2 * kStep)).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT((H.dxz - (above.dx - below.dx) / (2 * kStep)).cwiseAbs().maxCoeff(), kTolerance);
  for (int axis = 0; axis < Dim; ++axis) {
    Points<Dim> to = x, from = x;
    to.col(axis).array() += kStep;
    from.col(axis).array() -= kStep;
    const auto after = sampled<Dim>(to, z, Derivatives::kFirst),
               before = sampled<Dim>(from, z, Derivatives::kFirst);
    EXPECT_LT((H.dx.col(axis) - (after.value - before.value) / (2 * kStep)).cwiseAbs().maxCoeff(),
              kTolerance);
    const Points<Dim> of_gradient = (after.dx - before.dx) / (2 * kStep);
    EXPECT_LT((H.dxx.middleCols(Dim * axis, Dim) - of_gradient).cwiseAbs().maxCoeff(), kTolerance);
  }
}

TYPED_TEST(SquaredCurvature, HoldsWhatWasAskedForAndNoMore) {
  constexpr int Dim = TypeParam::value;
  const Points<Dim> x = some_places<Dim>();
  const Eigen::VectorXd z = some_curvatures(x.rows());
  const auto none = sampled<Dim>(x, z, Derivatives::kNone);
  EXPECT_EQ(none.value.size(), x.rows());
  EXPECT_EQ(none.dz.size() + none.dx.size(), 0);
  const auto first = sampled<Dim>(x, z, Derivatives::kFirst);
  EXPECT_EQ(first.dx.rows(), x.rows());
  EXPECT_EQ(first.dzz.size() + first.dxz.size() + first.dxx.size(), 0);
  EXPECT_EQ(first.value, none.value);
}

// The Willmore energy of a sphere with its own curvature as the spontaneous one.
TYPED_TEST(SquaredCurvature, VanishesAtTheSpontaneousCurvature) {
  constexpr int Dim = TypeParam::value;
  const Points<Dim> x = some_places<Dim>();
  const auto H =
      sampled<Dim>(x, Eigen::VectorXd::Constant(x.rows(), kSpontaneous), Derivatives::kSecond);
  EXPECT_EQ(H.value.cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(H.dz.cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(H.dx.cwiseAbs().maxCoeff(), 0);
  EXPECT_GT(H.dzz.minCoeff(), 0);
}

}  // namespace
}  // namespace surf::energy
