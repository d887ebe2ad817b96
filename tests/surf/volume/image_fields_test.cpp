#include "libsurf/volume/image_fields.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

using Eigen::Vector3d;

constexpr int kSize = 32;

Volume volume_of(const std::function<double(const Vector3d&)>& world_function,
                 const Eigen::Affine3d& affine = Eigen::Affine3d(Eigen::Scaling(0.5))) {
  std::vector<float> values;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i)
        values.push_back(static_cast<float>(world_function(affine * Vector3d(i, j, k))));
  return {{kSize, kSize, kSize}, affine, values};
}

Eigen::Affine3d turned_and_anisotropic() {
  return Eigen::Translation3d(3, 2, 1) * Eigen::AngleAxisd(0.4, Vector3d(1, 1, -2).normalized()) *
         Eigen::Scaling(0.5, 0.8, 1.3);
}

/// Voxel centres at least `margin` voxels from the border, in the world.
Points<3> inner_points(const Volume& volume, int margin) {
  std::vector<Vector3d> points;
  for (int k = margin; k < kSize - margin; k += 3)
    for (int j = margin; j < kSize - margin; j += 3)
      for (int i = margin; i < kSize - margin; i += 3)
        points.push_back(volume.index_to_world() * Vector3d(i + 0.3, j + 0.7, k));
  Points<3> out(points.size(), 3);
  for (std::size_t i = 0; i < points.size(); ++i) out.row(i) = points[i];
  return out;
}

Eigen::VectorXd values_at(const Field<3>& field, const Points<3>& x) {
  Samples<3> samples;
  field.sample(x, Derivatives::kNone, samples);
  return samples.value;
}

constexpr double kFloat = 1e-5;  // of values up to about 30 that are stored as floats

TEST(Gaussian, KeepsConstants) {
  const Volume volume = volume_of([](const Vector3d&) { return 7.25; });
  const auto field = intensity_field(volume, {.sigma_mm = 1.1});
  EXPECT_LT((values_at(*field, inner_points(volume, 0)).array() - 7.25).abs().maxCoeff(), kFloat);
}

TEST(Gaussian, KeepsLinearFunctionsOnAnyGrid) {
  const Vector3d slope(0.3, -0.4, 0.2);
  const Volume volume =
      volume_of([&](const Vector3d& x) { return slope.dot(x); }, turned_and_anisotropic());
  const auto field = intensity_field(volume, {.sigma_mm = 0.9});
  const Points<3> x = inner_points(volume, 9);  // 3 sigma = 5.4 voxels along the first axis, + 2
  EXPECT_LT((values_at(*field, x) - x * slope).cwiseAbs().maxCoeff(), kFloat);
}

// To the outer faces of the voxels, where half of the Gaussian lies outside.
TEST(Gaussian, KeepsLinearFunctionsAtTheBorder) {
  const Vector3d slope(0.3, -0.4, 0.2);
  const Volume volume =
      volume_of([&](const Vector3d& x) { return slope.dot(x); }, turned_and_anisotropic());
  Points<3> x(27, 3);
  for (int n = 0; n < 27; ++n) {
    const Eigen::Array3d part(n % 3, n / 3 % 3, n / 9);
    x.row(n) = volume.index_to_world() * Vector3d(part / 2 * kSize - 0.5);
  }
  for (const double sigma : {0.0, 0.4, 0.9, 2.5}) {
    const auto field = intensity_field(volume, {.sigma_mm = sigma});
    EXPECT_LT((values_at(*field, x) - x * slope).cwiseAbs().maxCoeff(), 3 * kFloat) << sigma;
  }
}

/// Standard deviation [mm] of the derivative of a step, sampled along x through the volume.
double step_width(const Field<3>& field, double step_at) {
  double mass = 0, second = 0;
  constexpr double kSpacing = 0.01;
  Samples<3> samples;
  Points<3> x(1500, 3);
  for (int i = 0; i < x.rows(); ++i) x.row(i) << kSpacing * i, 8, 8;
  field.sample(x, Derivatives::kFirst, samples);
  for (int i = 0; i < x.rows(); ++i) {
    mass += samples.gradient(i, 0);
    second += samples.gradient(i, 0) * std::pow(x(i, 0) - step_at, 2);
  }
  EXPECT_NEAR(mass * kSpacing, 1, 1e-3);  // the height of the step
  return std::sqrt(second / mass);
}

// Variances add up: the Gaussian's, and the spline's. With nodal values of a step between two
// voxels the derivative of the spline is the quadratic B-spline, of variance 3/12 voxel^2. From
// sigma = 0.7 mm on the field's nodes lie two voxels apart.
TEST(Gaussian, WidensAStepByItsVariance) {
  constexpr double kVoxel = 0.5, kStepAt = 7.75;  // between voxels 15 and 16
  const Volume volume = volume_of([&](const Vector3d& x) { return x[0] < kStepAt ? 0.0 : 1.0; });
  const auto variance = [&](double sigma) {
    return std::pow(step_width(*intensity_field(volume, {.sigma_mm = sigma}), kStepAt), 2);
  };
  const double spline = 3.0 / 12 * kVoxel * kVoxel;
  EXPECT_NEAR(variance(0), spline, 1e-3 * spline);
  for (const double sigma : {0.5, 0.65, 0.75, 1.0}) {
    const double expected = spline + sigma * sigma;
    // Truncation at 3 sigma takes away up to 3 % of the variance.
    EXPECT_NEAR(variance(sigma), expected, 0.03 * expected) << sigma;
  }
}

TEST(Gaussian, BlursAsMuchOnAGridOfEveryOtherVoxel) {
  const Vector3d wave(0.35, -0.5, 0.4);  // [1/mm], 9 mm long
  const auto value = [&](const Vector3d& x) { return std::sin(wave.dot(x)); };
  const Volume volume = volume_of(value);  // voxels of 0.5 mm
  const Points<3> x = inner_points(volume, 9);
  Eigen::VectorXd clean(x.rows());
  for (Eigen::Index i = 0; i < x.rows(); ++i) clean[i] = value(x.row(i));
  for (const double sigma : {0.69, 0.71}) {  // nodes 0.5 and 1 mm apart
    // Gaussian and spline (variance h^2/3 per axis) damp a wave by exp(-variance |k|^2 / 2).
    const double damped = std::exp(-(sigma * sigma + 0.25 / 3) * wave.squaredNorm() / 2);
    const Eigen::VectorXd values = values_at(*intensity_field(volume, {.sigma_mm = sigma}), x);
    EXPECT_LT((values - damped * clean).cwiseAbs().maxCoeff(), 0.005) << sigma;
  }
}

// Nodes 4 voxels apart, 8 and 16 of the last two, which are two Gaussians: the place of the step
// between them moves it by 0.6 % of the blur and changes the variance by 4 % at most, and
// truncation takes away up to 3 %.
TEST(Gaussian, WidensAStepByItsVarianceOnCoarseGrids) {
  constexpr int kLong = 320, kWide = 12;
  for (const int step : {156, 158, 159, 160, 163}) {
    std::vector<float> values;
    for (int n = 0; n < kLong * kWide * kWide; ++n) values.push_back(n % kLong < step ? 0 : 1);
    const Volume volume({kLong, kWide, kWide}, Eigen::Affine3d::Identity(), values);
    for (const double sigma : {2.9, 5.7, 9.0, 15.0}) {
      const auto field = intensity_field(volume, {.sigma_mm = sigma});
      Points<3> x(2 * kLong, 3);
      for (int i = 0; i < x.rows(); ++i) x.row(i) << 0.5 * i, 5.5, 5.5;
      Samples<3> samples;
      field->sample(x, Derivatives::kFirst, samples);
      double mass = 0, first = 0, second = 0;
      for (int i = 0; i < x.rows(); ++i) {
        const double weight = samples.gradient(i, 0), from_step = x(i, 0) - (step - 0.5);
        mass += weight;
        first += weight * from_step;
        second += weight * from_step * from_step;
      }
      EXPECT_NEAR(first / mass, 0, 0.01 * sigma) << sigma << ' ' << step;
      const double expected = sigma * sigma + 0.25;
      EXPECT_NEAR(second / mass, expected, 0.06 * expected) << sigma << ' ' << step;
    }
  }
}

TEST(Gaussian, IsIsotropicInMillimetresOnAnisotropicVoxels) {
  const Vector3d center = turned_and_anisotropic() * Vector3d::Constant(15.5);
  const Volume volume = volume_of(
      [&](const Vector3d& x) { return std::exp(-(x - center).squaredNorm() / (2 * 4.0)); },
      turned_and_anisotropic());
  const auto field = intensity_field(volume, {.sigma_mm = 2});
  // A Gaussian of variance 4 becomes one of 8 (and the spline adds h^2/3 along each axis).
  Points<3> x(3, 3);
  for (int axis = 0; axis < 3; ++axis)
    x.row(axis) = center + 2 * volume.index_to_world().linear().col(axis).normalized();
  const Eigen::VectorXd values = values_at(*field, x);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(values[axis], std::pow(0.5, 1.5) * std::exp(-4.0 / 16), 0.02) << axis;
}

/// A step of height 1 at x = 7.75 mm with noise of deviation 0.02.
Volume noisy_step() {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0, 0.02);
  return volume_of(
      [&](const Vector3d& x) { return (x[0] < 7.75 ? 0.0 : 1.0) + normal(generator); });
}

double deviation(const Eigen::VectorXd& values) {
  return std::sqrt((values.array() - values.mean()).square().mean());
}

/// Largest slope [1/mm] on a line along x through the step, mean of 100 lines.
double steepest(const Field<3>& field) {
  Samples<3> samples;
  double sum = 0;
  for (int line = 0; line < 100; ++line) {
    Points<3> x(200, 3);
    for (int i = 0; i < x.rows(); ++i)
      x.row(i) << 6.75 + 0.01 * i, 4 + 0.5 * (line % 10), 4 + 0.5 * (line / 10);
    field.sample(x, Derivatives::kFirst, samples);
    sum += samples.gradient.col(0).maxCoeff();
  }
  return sum / 100;
}

TEST(SelectiveBlur, KeepsTheEdgeAboveTheThresholdAndFlattensTheNoiseBelow) {
  const Volume volume = noisy_step();
  const auto blurred =
      intensity_field(volume, {.selective_sigma_mm = 0.75, .selective_threshold = 0.3});
  const auto plain = intensity_field(volume, {});
  const auto gaussian = intensity_field(volume, {.sigma_mm = 0.75});
  Points<3> flat(400, 3);
  for (int i = 0; i < 400; ++i)
    flat.row(i) << 4 + 0.5 * (i % 4), 4 + 0.5 * (i / 4 % 10), 4 + i / 40;
  EXPECT_LT(deviation(values_at(*blurred, flat)), 0.35 * deviation(values_at(*plain, flat)));
  EXPECT_NEAR(steepest(*blurred), steepest(*plain), 0.03 * steepest(*plain));
  EXPECT_LT(steepest(*gaussian), 0.6 * steepest(*plain));
}

TEST(SelectiveBlur, WithAHugeThresholdBlursTheEdgeToo) {
  const Volume volume = noisy_step();
  const auto blurred =
      intensity_field(volume, {.selective_sigma_mm = 0.75, .selective_threshold = 100});
  EXPECT_LT(steepest(*blurred), 0.6 * steepest(*intensity_field(volume, {})));
}

class EdgeIndicator : public ::testing::TestWithParam<DerivativeFilter> {};
INSTANTIATE_TEST_SUITE_P(Filters, EdgeIndicator,
                         ::testing::Values(DerivativeFilter::kBSpline, DerivativeFilter::kScharr),
                         [](const auto& filter) {
                           return filter.param == DerivativeFilter::kScharr ? "Scharr" : "BSpline";
                         });

TEST_P(EdgeIndicator, IsOneWhereTheImageIsConstant) {
  const Volume volume = volume_of([](const Vector3d&) { return -3.0; });
  const auto H = edge_indicator(volume, {.sigma_mm = 0.5}, 0.1, GetParam());
  EXPECT_LT((values_at(*H, inner_points(volume, 0)).array() - 1).abs().maxCoeff(), 1e-15);
}

// H = 1 / (1 + |g|^2 / lambda^2) with the gradient in the world, on any grid.
TEST_P(EdgeIndicator, OfALinearRampIsTheFormulaOnAnyGrid) {
  const Vector3d slope(0.3, -0.4, 1.2);
  const Volume volume =
      volume_of([&](const Vector3d& x) { return slope.dot(x); }, turned_and_anisotropic());
  const Points<3> x = inner_points(volume, 8);
  for (const double lambda : {0.5, 1.3, 20.0}) {
    const auto H = edge_indicator(volume, {.sigma_mm = 0.5}, lambda, GetParam());
    const double expected = 1 / (1 + slope.squaredNorm() / (lambda * lambda));
    EXPECT_LT((values_at(*H, x).array() - expected).abs().maxCoeff(), 10 * kFloat) << lambda;
  }
}

TEST_P(EdgeIndicator, LiesAboveZeroAndNotAboveOne) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(-1000, 1000);
  const Volume volume = volume_of([&](const Vector3d&) { return uniform(generator); });
  const auto H = edge_indicator(volume, {}, 30, GetParam());
  const Eigen::VectorXd values = values_at(*H, inner_points(volume, 0));
  EXPECT_GT(values.minCoeff(), 0);
  EXPECT_LE(values.maxCoeff(), 1);
}

TEST_P(EdgeIndicator, DoesNotChangeWhenTheIntensitiesAreMappedWithLambda) {
  const auto wave = [](const Vector3d& x) { return std::sin(x[0]) * std::cos(0.7 * x[1] + x[2]); };
  const Volume volume = volume_of(wave);
  const Volume mapped = volume_of([&](const Vector3d& x) { return -64 * wave(x); });
  const auto H = edge_indicator(volume, {.sigma_mm = 0.5}, 0.5, GetParam());
  const auto H_mapped = edge_indicator(mapped, {.sigma_mm = 0.5}, 0.5 * 64, GetParam());
  const Points<3> x = inner_points(volume, 0);
  EXPECT_EQ(values_at(*H, x), values_at(*H_mapped, x));  // powers of two: the same bits
}

TEST_P(EdgeIndicator, IsSmallestOnTheEdge) {
  const Volume volume = volume_of([](const Vector3d& x) { return std::tanh((x[0] - 7.6) / 1.0); });
  const auto H = edge_indicator(volume, {.sigma_mm = 0.5}, 0.3, GetParam());
  Points<3> x(400, 3);
  for (int i = 0; i < 400; ++i) x.row(i) << 4 + 0.02 * i, 8, 8;
  Eigen::Index at;
  values_at(*H, x).minCoeff(&at);
  EXPECT_NEAR(x(at, 0), 7.6, 0.03);  // 0.06 voxel
}

// Nodes at every other voxel, of which there is one tile; the edge indicator needs no more of them.
TEST(SmoothedVolume, SmoothsOnceForAllItsFieldsAndToTheSameBits) {
  const Volume volume = volume_of([](const Vector3d& x) { return std::sin(x.sum()); });
  const SmoothingOptions smoothing = {.sigma_mm = 0.8};
  const Points<3> x = inner_points(volume, 14);
  const SmoothedVolume smoothed(volume, smoothing);
  const std::size_t before = smoothed.memory_bytes();
  EXPECT_EQ(values_at(*smoothed.intensity(), x), values_at(*intensity_field(volume, smoothing), x));
  const std::size_t with_intensity = smoothed.memory_bytes();
  EXPECT_GT(with_intensity, before);
  EXPECT_EQ(values_at(*smoothed.edge_indicator(2), x),
            values_at(*edge_indicator(volume, smoothing, 2), x));
  EXPECT_EQ(smoothed.memory_bytes(), with_intensity);
}

TEST(ImageFields, RefuseOptionsThatAreWrong) {
  const Volume volume = volume_of([](const Vector3d&) { return 0.0; });
  EXPECT_THROW(intensity_field(volume, {.sigma_mm = -1}), UsageError);
  EXPECT_THROW(intensity_field(volume, {.selective_sigma_mm = -1}), UsageError);
  EXPECT_THROW(intensity_field(volume, {.selective_sigma_mm = 1}), UsageError);
  EXPECT_THROW(edge_indicator(volume, {.sigma_mm = -1}, 1), UsageError);
  EXPECT_THROW(edge_indicator(volume, {}, 0), UsageError);
  EXPECT_THROW(edge_indicator(volume, {}, std::nan("")), UsageError);
}

/// A ball of radius 40 voxels, its edge one voxel wide, in so many that they have blocks.
Volume large_volume() {
  constexpr std::array<int, 3> kLarge = {484, 484, 484};
  Volume::Builder builder(kLarge, Eigen::Matrix4d::Identity(), {});
  std::vector<float> slice(std::size_t(kLarge[0]) * kLarge[1]);
  for (int k = 0; k < kLarge[2]; ++k) {
    for (int j = 110; j < 220; ++j)
      for (int i = 100; i < 210; ++i) {
        const double r = (Vector3d(i, j, k) - Vector3d(150.2, 161.9, 170.4)).norm();
        slice[std::size_t(j) * kLarge[0] + i] =
            float(std::lround(200 * std::clamp(40.5 - r, 0.0, 1.0)));
      }
    builder.append_slice(slice);
  }
  return builder.finish();
}

// The edge is where the value is half of the ball's; a block has three voxels along each axis.
TEST(RoughIntensity, HasEdgesWhereTheyAreToAFewHundredthsOfABlock) {
  const Volume volume = large_volume();
  ASSERT_TRUE(volume.coarser());
  EXPECT_EQ(volume.coarser()->size(), (std::array<int, 3>{162, 162, 162}));
  const SmoothingOptions smoothing{.sigma_mm = 2.4};
  const auto rough = rough_intensity_field(volume, smoothing),
             exact = intensity_field(volume, smoothing);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Points<3> x(200, 3);
  Points<3> outwards(200, 3);
  for (int n = 0; n < 200; ++n) {
    outwards.row(n) = Vector3d(normal(random), normal(random), normal(random)).normalized();
    x.row(n) = Vector3d(150.2, 161.9, 170.4).transpose() + 40 * outwards.row(n);
  }
  Samples<3> a, b;
  rough->sample(x, Derivatives::kFirst, a);
  exact->sample(x, Derivatives::kFirst, b);
  const Eigen::ArrayXd slope = (b.gradient.array() * outwards.array()).rowwise().sum();
  const Eigen::ArrayXd off = (a.value - b.value).array() / slope.abs();  // [voxels]
  EXPECT_LT(off.abs().maxCoeff(), 0.18);
  EXPECT_LT(std::abs(off.mean()), 0.02);
  const Eigen::ArrayXd rough_slope = (a.gradient.array() * outwards.array()).rowwise().sum();
  EXPECT_NEAR(rough_slope.mean() / slope.mean(), 1, 0.05);  // as blurred
}

TEST(RoughIntensity, IsTheIntensityWhereTheBlurIsNarrowOrThereAreNoBlocks) {
  const Volume large = large_volume(),
               small = volume_of([](const Vector3d&x) { return x[0] * x[1]; });
  Points<3> x(3, 3);
  x << 150.2, 161.9, 130.4, 190.3, 161, 170, 4, 5, 6;
  for (const auto& [volume, smoothing] :
       {std::pair(large, SmoothingOptions{.sigma_mm = 0.8}),
        {large,
         SmoothingOptions{.sigma_mm = 2.4, .selective_sigma_mm = 0.5, .selective_threshold = 50}},
        {small, SmoothingOptions{.sigma_mm = 1.6}}})
    EXPECT_EQ(values_at(*rough_intensity_field(volume, smoothing), x),
              values_at(*intensity_field(volume, smoothing), x));
}

}  // namespace
}  // namespace surf::volume
