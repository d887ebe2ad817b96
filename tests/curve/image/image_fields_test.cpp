#include "libcurve/image/image_fields.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libcurve/image/phantom.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

/// An oblique, anisotropic, mirrored grid.
Eigen::Affine2d odd_affine() {
  Eigen::Affine2d out;
  out.linear() << 0.8, -0.3, -0.2, -1.1;
  out.translation() << 3, 40;
  out.makeAffine();
  return out;
}

Image image_of(const std::array<int, 2>& size, const Eigen::Affine2d& affine,
               const std::function<double(const Eigen::Vector2d&)>& f) {
  std::vector<float> values;
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i)
      values.push_back(static_cast<float>(f(affine * Eigen::Vector2d(i, j))));
  return Image(size, affine, values);
}

Samples<2> sample(const Field<2>& field, const Vector<2>& x) {
  Samples<2> out;
  Points<2> at(1, 2);
  at.row(0) = x.transpose();
  field.sample(at, Derivatives::kSecond, out);
  return out;
}

class ImageFields : public ::testing::TestWithParam<Interpolation> {};
INSTANTIATE_TEST_SUITE_P(Both, ImageFields,
                         ::testing::Values(Interpolation::kSpline, Interpolation::kLinear));

// Smoothing, spline and interpolation all leave a linear function as it is.
TEST_P(ImageFields, ReproduceALinearFunctionOnAnyGrid) {
  const auto affine = odd_affine();
  const Image image =
      image_of({40, 30}, affine, [](const auto& x) { return 2 * x[0] - 3 * x[1] + 7; });
  const auto field =
      intensity_field(image, {.smoothing = {.sigma_mm = 0.8}, .interpolation = GetParam()});
  const Vector<2> x = affine * Eigen::Vector2d(20.3, 14.6);
  const Samples<2> at = sample(*field, x);
  constexpr double kFloat = 1e-4;  // of values of order 100
  EXPECT_NEAR(at.value[0], 2 * x[0] - 3 * x[1] + 7, kFloat);
  EXPECT_NEAR(at.gradient(0, 0), 2, kFloat);
  EXPECT_NEAR(at.gradient(0, 1), -3, kFloat);
  EXPECT_LT(at.hessian.norm(), kFloat);
}

TEST_P(ImageFields, DerivativesAreThoseOfTheValue) {
  const auto affine = odd_affine();
  const Image image = image_of(
      {40, 30}, affine, [](const auto& x) { return std::sin(0.3 * x[0]) * std::cos(0.2 * x[1]); });
  for (const auto& field :
       {intensity_field(image, {.interpolation = GetParam()}),
        edge_indicator(image, {.smoothing = {.sigma_mm = 1}, .interpolation = GetParam()}, 0.1)}) {
    const Vector<2> x = affine * Eigen::Vector2d(20.3, 14.6);
    const Samples<2> at = sample(*field, x);
    constexpr double kStep = 1e-4, kTolerance = 1e-6;  // kStep^2 times third derivatives
    for (int axis = 0; axis < 2; ++axis) {
      const Vector<2> step = kStep * Vector<2>::Unit(axis);
      const Samples<2> plus = sample(*field, x + step), minus = sample(*field, x - step);
      EXPECT_NEAR(at.gradient(0, axis), (plus.value[0] - minus.value[0]) / (2 * kStep), kTolerance);
      for (int other = 0; other < 2; ++other)
        EXPECT_NEAR(at.hessian(0, 2 * axis + other),
                    (plus.gradient(0, other) - minus.gradient(0, other)) / (2 * kStep), kTolerance);
    }
  }
}

TEST(SplineIntegral, ItsSlopeAlongTheColumnsIsTheField) {
  const auto affine = odd_affine();
  const Image image = image_of(
      {40, 30}, affine, [](const auto& x) { return std::sin(0.3 * x[0]) * std::cos(0.2 * x[1]); });
  const FieldOptions options{.smoothing = {.sigma_mm = 0.5}};
  const auto I = intensity_field(image, options), P = intensity_antiderivative(image, options);
  constexpr double kStep = 1e-4, kTolerance = 1e-6;  // kStep^2 times third derivatives
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(20.3, 14.6), {0.5, 0.2}, {38.9, 28.9}, {-3, 12}, {50, -2}}) {
    const auto at = [&](double u) {
      return sample(*P, affine * Eigen::Vector2d(pixel[0] + u, pixel[1])).value[0];
    };
    EXPECT_NEAR((at(kStep) - at(-kStep)) / (2 * kStep), sample(*I, affine * pixel).value[0],
                kTolerance);
  }
}

TEST_P(ImageFields, GoOnConstantlyOutside) {
  const Image image =
      image_of({8, 8}, Eigen::Affine2d::Identity(), [](const auto& x) { return x[0]; });
  const Samples<2> at = sample(*intensity_field(image, {.interpolation = GetParam()}), {100, 3.5});
  EXPECT_NEAR(at.value[0], 7, 0.2);  // the spline's blur at the border: 1/6
  EXPECT_EQ(at.gradient(0, 0), 0);
}

// A Gaussian of variance s^2 on exp(-r^2 / 2 w^2) gives w^2 / (w^2 + s^2) of its height; the spline
// adds a variance of 1/3.
TEST(ImageFieldsOfAGaussian, AreBlurredByTheirSigma) {
  constexpr double kWidth = 4, kSigma = 3;
  const Image image = image_of({61, 61}, Eigen::Affine2d::Identity(), [](const auto& x) {
    return std::exp(-(x - Eigen::Vector2d(30, 30)).squaredNorm() / (2 * kWidth * kWidth));
  });
  const double variance = kWidth * kWidth, blur = kSigma * kSigma;
  const auto at = [&](Interpolation interpolation) {
    return sample(*intensity_field(
                      image, {.smoothing = {.sigma_mm = kSigma}, .interpolation = interpolation}),
                  {30, 30})
        .value[0];
  };
  constexpr double kTruncation = 0.01;  // at 3 sigma, 0.3 % of the weight per axis
  EXPECT_NEAR(at(Interpolation::kLinear), variance / (variance + blur), kTruncation);
  EXPECT_NEAR(at(Interpolation::kSpline), variance / (variance + blur + 1.0 / 3), kTruncation);
}

TEST(EdgeIndicator, IsTheFormulaOnAnEdge) {
  // The edge of a half plane: |grad I| = 2 / (eps sqrt(pi)) on it.
  constexpr double kEdge = 20, kLambda = 0.05;
  const Image image = image_of({101, 101}, Eigen::Affine2d::Identity(), [](const auto& x) {
    return 0.5 * (1 + std::erf(2 * (50 - x[0]) / kEdge));
  });
  const double slope = 2 / (kEdge * std::sqrt(M_PI));
  const double H = 1 / (1 + slope * slope / (kLambda * kLambda));
  for (const auto filter :
       {volume::DerivativeFilter::kBSpline, volume::DerivativeFilter::kScharr}) {
    const auto field = edge_indicator(image, {.filter = filter}, kLambda);
    EXPECT_NEAR(sample(*field, {50, 50}).value[0], H, 0.01 * H);  // differences over two pixels
    EXPECT_NEAR(sample(*field, {2, 50}).value[0], 1, 1e-3);
  }
  EXPECT_THROW(edge_indicator(image, {}, 0), UsageError);
}

TEST(SelectiveBlur, SmoothsNoiseAndKeepsSteps) {
  const Image noisy = make_phantom({.kind = PhantomKind::kRing, .edge_width = 1e-6, .noise = 0.05});
  const auto field =
      intensity_field(noisy, {.smoothing = {.selective_sigma_mm = 2, .selective_threshold = 0.4},
                              .interpolation = Interpolation::kLinear});
  const Image clean = make_phantom({.kind = PhantomKind::kRing, .edge_width = 1e-6});
  double worst = 0, before = 0;
  for (int i = 0; i < 256; ++i) {
    worst =
        std::max(worst, std::abs(sample(*field, {double(i), 128}).value[0] - clean.value(i, 128)));
    before = std::max(before, std::abs(double(noisy.value(i, 128)) - clean.value(i, 128)));
  }
  EXPECT_LT(worst, before / 2);  // a mean over some 50 pixels: a seventh, less at the borders
}

}  // namespace
}  // namespace surf::curve
