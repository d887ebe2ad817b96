#include "libsurf/segment/seed_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libsurf/segment/detail/volume_model.h"
#include "libsurf/volume/image_fields.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

using Eigen::Vector3d;

/// A ball of radius 0.6 units in 64^3 voxels: 18.9 voxels, edges of 0.05 units each way.
volume::PhantomOptions ball(double noise = 0) {
  volume::PhantomOptions options;
  options.size = {64, 64, 64};
  options.noise = noise;
  return options;
}

const std::vector<Vector3d> kCentre = {Vector3d::Zero()};

SeedModel model_of(const volume::Volume& volume, const std::vector<Vector3d>& seeds = kCentre) {
  return estimate_seed_model<3>(*volume::intensity_field(volume, {}), seeds, extent_of(volume));
}

TEST(SeedModel, OfACleanBallHasItsIntensityAndReachesItsEdge) {
  const auto volume = volume::make_phantom(ball());
  const SeedModel model = model_of(volume);
  EXPECT_NEAR(model.mean, 1, 1e-6);
  EXPECT_LT(model.noise, 1e-6);
  EXPECT_NEAR(model.radius_mm, 0.6 - 0.05, 3 * volume.voxel_size());
  EXPECT_LE(model.radius_mm, 0.6);
}

TEST(SeedModel, MeasuresTheNoise) {
  const SeedModel model = model_of(volume::make_phantom(ball(0.1)));
  // The spline averages noise with 1/6, 4/6, 1/6 along three axes: (1/2)^(3/2) of its deviation.
  const double smoothed = 0.1 * std::pow(0.5, 1.5);
  EXPECT_NEAR(model.mean, 1, smoothed);
  EXPECT_LT(model.deviation, 2 * smoothed);  // of 33 points at least, which are correlated
  EXPECT_GT(model.deviation, 0.3 * smoothed);
  EXPECT_LE(model.noise, model.deviation);
  EXPECT_GT(model.noise, 0.2 * smoothed);
}

TEST(SeedModel, ScalesWithTheIntensities) {
  const auto volume = volume::make_phantom(ball(0.1));
  std::vector<float> mapped(volume.n_voxels());
  volume.copy_box({0, 0, 0}, volume.size(), mapped.data());
  for (float& value : mapped) value *= -64;
  const SeedModel a = model_of(volume);
  const SeedModel b = model_of({volume.size(), volume.index_to_world(), mapped});
  EXPECT_DOUBLE_EQ(b.mean, -64 * a.mean);
  EXPECT_DOUBLE_EQ(b.deviation, 64 * a.deviation);
  EXPECT_DOUBLE_EQ(b.noise, 64 * a.noise);
  EXPECT_EQ(b.radius_mm, a.radius_mm);
}

TEST(SeedModel, TakesItsMeansOverAllSeeds) {
  auto options = ball();
  options.kind = volume::PhantomKind::kTwoBalls;
  const SeedModel model =
      model_of(volume::make_phantom(options), {Vector3d(-0.4, 0, 0), Vector3d(0.4, 0, 0)});
  EXPECT_NEAR(model.mean, 1, 1e-6);
  EXPECT_LE(model.radius_mm, 0.4);
}

double strength(const volume::Volume& volume) {
  return estimate_edge_strength<3>(*volume::intensity_field(volume, {}), kCentre,
                                   extent_of(volume));
}

// The steepest slope of the step (1 + t + sin(pi t)/pi)/2, t = d/w, is 1/w; the spline and the
// voxels take some of it away.
TEST(EdgeStrength, IsAQuarterOfTheSlopeOfTheFirstEdge) {
  const double slope = 1 / 0.05;
  const double lambda = strength(volume::make_phantom(ball()));
  EXPECT_LT(lambda, 0.25 * slope);
  EXPECT_GT(lambda, 0.6 * 0.25 * slope);
}

TEST(EdgeStrength, ScalesWithTheIntensitiesAndTheUnitOfLength) {
  const auto volume = volume::make_phantom(ball());
  const double lambda = strength(volume);
  std::vector<float> mapped(volume.n_voxels());
  volume.copy_box({0, 0, 0}, volume.size(), mapped.data());
  for (float& value : mapped) value = -64 * value + 1024;
  EXPECT_NEAR(strength({volume.size(), volume.index_to_world(), mapped}), 64 * lambda,
              1e-4 * 64 * lambda);
  const Eigen::Affine3d longer = Eigen::Scaling(1000.0) * volume.index_to_world();
  std::vector<float> same(volume.n_voxels());
  volume.copy_box({0, 0, 0}, volume.size(), same.data());
  EXPECT_NEAR(strength({volume.size(), longer, same}), lambda / 1000, 1e-6 * lambda / 1000);
}

TEST(EdgeStrength, TakesNoiseForNoEdge) {
  const auto volume = volume::make_phantom(ball(0.1));
  const auto field = volume::intensity_field(volume, {});
  Samples<3> samples;
  field->sample(0.3 * directions<3>(500), Derivatives::kFirst, samples);
  std::vector<double> inside;
  for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
    inside.push_back(samples.gradient.row(i).norm());
  EXPECT_GT(strength(volume), 2 * median(inside));
}

// As bone in a CT beside a soft organ.
TEST(EdgeStrength, DoesNotGrowWithWhatIsFarAway) {
  const auto volume = volume::make_phantom(ball(0.03));
  std::vector<float> values(volume.n_voxels());
  volume.copy_box({0, 0, 0}, volume.size(), values.data());
  for (std::size_t at = values.size() - values.size() / 30; at < values.size(); ++at)
    values[at] = 15;
  const double lambda = strength(volume);
  EXPECT_NEAR(strength({volume.size(), volume.index_to_world(), values}), lambda, 0.05 * lambda);
}

TEST(EdgeStrength, OfAnEmptyImageIsPositive) {
  const volume::Volume empty({8, 8, 8}, Eigen::Affine3d::Identity(), std::vector<float>(512, 3));
  EXPECT_GT(estimate_edge_strength<3>(*volume::intensity_field(empty, {}),
                                      std::vector{Vector3d(4, 4, 4)}, extent_of(empty)),
            0);
}

TEST(SphereDirections, AreUnitVectorsSpreadEvenly) {
  const Points<3> u = directions<3>(200);
  EXPECT_LT((u.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-15);
  EXPECT_LT(u.colwise().mean().norm(), 1e-15);
  const Eigen::Matrix3d second = u.transpose() * u / double(u.rows());
  EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3).norm(), 1e-15);
  for (Eigen::Index i = 0; i < u.rows(); ++i) {  // an even share for each
    Eigen::VectorXd cosines = u * u.row(i).transpose();
    cosines[i] = -1;
    EXPECT_NEAR(std::acos(cosines.maxCoeff()), std::sqrt(4 * std::numbers::pi / 200), 0.1);
  }
}

TEST(Median, IsTheUpperMiddleValueAndZeroOfNothing) {
  EXPECT_EQ(median({}), 0);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 3);
}

}  // namespace
}  // namespace surf::segment
