#include "libsurf/energy/fields.h"

#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Fields);

TYPED_TEST(Fields, ConstantHasItsValueAndNoDerivatives) {
  constexpr int Dim = TypeParam::value;
  Samples<Dim> samples;
  constant_field<Dim>(2.5)->sample(test::unit_sphere<Dim>(1).X, Derivatives::kSecond, samples);
  EXPECT_EQ(samples.value.minCoeff(), 2.5);
  EXPECT_EQ(samples.value.maxCoeff(), 2.5);
  EXPECT_EQ(samples.gradient.norm(), 0);
  EXPECT_EQ(samples.hessian.norm(), 0);
}

TYPED_TEST(Fields, MappedFieldHasTheDerivativesOfItsValues) {
  constexpr int Dim = TypeParam::value;
  const auto F = mapped_field<Dim>(std::make_shared<const test::WaveField<Dim>>(1),
                                   intensity_window(1.4, 0.3));
  const Points<Dim> x = test::random_smooth_shape<Dim>(1, 2).X;
  constexpr double kStep = 1e-5;       // truncation ~ kStep^2 / half-width^3
  constexpr double kTolerance = 1e-7;  // rounding ~ eps / kStep
  Samples<Dim> at, plus, minus;
  F->sample(x, Derivatives::kSecond, at);
  for (int d = 0; d < Dim; ++d) {
    Points<Dim> forward = x, backward = x;
    forward.col(d).array() += kStep;
    backward.col(d).array() -= kStep;
    F->sample(forward, Derivatives::kFirst, plus);
    F->sample(backward, Derivatives::kFirst, minus);
    const Eigen::VectorXd slope = (plus.value - minus.value) / (2 * kStep);
    EXPECT_LT((slope - at.gradient.col(d)).cwiseAbs().maxCoeff(), kTolerance);
    for (int e = 0; e < Dim; ++e) {
      const Eigen::VectorXd second = (plus.gradient.col(e) - minus.gradient.col(e)) / (2 * kStep);
      EXPECT_LT((second - at.hessian.col(d * Dim + e)).cwiseAbs().maxCoeff(), kTolerance);
    }
  }
}

TYPED_TEST(Fields, MappedFieldComputesNoMoreThanIsAskedFor) {
  constexpr int Dim = TypeParam::value;
  const auto F = mapped_field<Dim>(std::make_shared<const test::WaveField<Dim>>(1),
                                   intensity_window(1.4, 0.3));
  Samples<Dim> samples;
  F->sample(test::unit_sphere<Dim>(1).X, Derivatives::kNone, samples);
  EXPECT_EQ(samples.gradient.rows(), 0);
  EXPECT_EQ(samples.hessian.rows(), 0);
}

TEST(IntensityWindow, IsMinusOneInsideZeroAtItsEndsAndOneOutside) {
  const Profile f = intensity_window(100, 20);
  EXPECT_EQ(f(100)[0], -1);
  EXPECT_NEAR(f(120)[0], 0, 1e-15);
  EXPECT_NEAR(f(80)[0], 0, 1e-15);
  EXPECT_LT(f(110)[0], -0.85);
  EXPECT_GT(f(140)[0], 0.85);
  EXPECT_NEAR(f(1e6)[0], 1, 1e-12);
  EXPECT_NEAR(f(-1e6)[0], 1, 1e-12);
}

TEST(IntensityWindow, HasTheDerivativesOfItsValues) {
  const Profile f = intensity_window(100, 20);
  constexpr double kStep = 1e-3;  // truncation ~ kStep^2 / 20^3, rounding ~ eps / kStep
  for (double I = 20; I <= 180; I += 3.7) {
    EXPECT_NEAR((f(I + kStep)[0] - f(I - kStep)[0]) / (2 * kStep), f(I)[1], 1e-8) << I;
    EXPECT_NEAR((f(I + kStep)[1] - f(I - kStep)[1]) / (2 * kStep), f(I)[2], 1e-9) << I;
  }
}

TEST(IntensityWindow, DoesNotChangeWhenIntensitiesMeanAndWidthAreMapped) {
  const Profile f = intensity_window(1.5, 0.25), mapped = intensity_window(-8 * 1.5 + 3, 8 * 0.25);
  for (double I = 0; I <= 3; I += 0.1) EXPECT_NEAR(f(I)[0], mapped(-8 * I + 3)[0], 1e-14) << I;
}

}  // namespace
}  // namespace surf::energy
