#include "libsurf/segment/detail/local_means.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

constexpr int kSize = 40;
constexpr double kVoxel = 2.0 / (kSize - 1), kRadius = 0.6;

struct Scene {
  std::shared_ptr<const Setting<3>> setting;
  std::shared_ptr<const Field<3>> I;
  std::shared_ptr<const Field<3>> f;

  /// @param radius  of the start
  explicit Scene(double radius, double noise = 0.01) {
    volume::PhantomOptions options;
    options.size = {kSize, kSize, kSize};
    setting = make_setting(volume::make_phantom(options));
    I = setting->make_model({.smoothing = {.sigma_mm = 0.4 * kVoxel}})->intensity();
    const Triangles start = mesh::ball(Vector<3>::Zero(), radius, kVoxel);
    f = local_means<3>(*setting, I, start, {3 * kVoxel, kVoxel, noise});
  }

  double at(double r) const {
    Points<3> x(1, 3);
    x << r / std::sqrt(3.0), r / std::sqrt(3.0), r / std::sqrt(3.0);
    Samples<3> samples;
    f->sample(x, Derivatives::kNone, samples);
    return samples.value[0];
  }
};

TEST(LocalMeans, ChangeSignWhereTheIntensityIsBetweenBothMeans) {
  // Starts a voxel off on either side.
  for (const double radius : {kRadius - kVoxel, kRadius + kVoxel}) {
    const Scene scene(radius);
    EXPECT_LT(scene.at(kRadius - 0.3 * kVoxel), 0);
    EXPECT_GT(scene.at(kRadius + 0.3 * kVoxel), 0);
  }
}

TEST(LocalMeans, KeepTheShapeWithinReachOfItsStart) {
  const Scene scene(kRadius - 6 * kVoxel);  // the edge is twice the reach away
  EXPECT_GT(scene.at(kRadius - kVoxel), 0);
  EXPECT_LT(scene.at(0.1), -1);
}

// It was half as strong in the outermost voxels, and shapes leaked there along the border.
TEST(LocalMeans, KeepTheShapeNearItsStartAtTheBorderToo) {
  const Scene scene(kRadius);
  const Triangles start = mesh::ball(Vector<3>(0, 0, -0.98), 0.4, kVoxel);
  const auto f = local_means<3>(*scene.setting, scene.I, start, {3 * kVoxel, kVoxel, 0.01});
  Points<3> x(2, 3);
  x << 0.4 + 4 * kVoxel, 0, -1, 0, 0.4 + 4 * kVoxel, -1;
  Samples<3> samples;
  f->sample(x, Derivatives::kNone, samples);
  for (const double value : samples.value) EXPECT_GT(value, 8);  // 3/2 (5/4)^9 - 1 = 10
}

// With the mean of what is beyond it, -4, all of the layer is nearer to that of the ball.
TEST(LocalMeans, LeaveAThinLayerBeforeSomethingElseByFarOutside) {
  std::vector<float> values;
  const auto place = [](int index) { return (index - (kSize - 1) / 2.0) * kVoxel; };
  for (int z = 0; z < kSize; ++z)
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const double r = Eigen::Vector3d(place(x), place(y), place(z)).norm();
        const float beyond = place(x) > 0.3 && r > kRadius + 3 * kVoxel ? -4.f : 0.f;
        values.push_back(r < kRadius ? 1.f : beyond);
      }
  Eigen::Affine3d affine = Eigen::Translation3d::Identity() * Eigen::Scaling(kVoxel);
  affine.translation().setConstant(place(0));
  const auto setting = make_setting(volume::Volume({kSize, kSize, kSize}, affine, values));
  const auto I = setting->make_model({.smoothing = {.sigma_mm = 0.4 * kVoxel}})->intensity();
  const Triangles start = mesh::ball(Vector<3>::Zero(), kRadius, kVoxel);
  const auto f = local_means<3>(*setting, I, start, {3 * kVoxel, kVoxel, 0.01});
  Points<3> x(2, 3);
  x << kRadius + kVoxel, 0, 0, kRadius - kVoxel, 0, 0;
  Samples<3> samples;
  f->sample(x, Derivatives::kNone, samples);
  EXPECT_GT(samples.value[0], 0);
  EXPECT_LT(samples.value[1], 0);
}

/// Dark where another one is bright: what is outside is 1.
struct Dark : Field<3> {
  std::shared_ptr<const Field<3>> bright;

  explicit Dark(std::shared_ptr<const Field<3>> of) : bright(std::move(of)) {}
  void sample(const Points<3>& x, Derivatives, Samples<3>& out) const override {
    bright->sample(x, Derivatives::kNone, out);
    out.value = 1 - out.value.array();
  }
};

// Squares of distances beyond 100 nodes do not fit into 16 bits: most of the mean outside was lost.
TEST(LocalMeans, ReachAsFarAsIsAskedFor) {
  volume::PhantomOptions options;
  options.size = {200, 200, 40};
  options.edge_width_mm = 0.05;
  const auto setting = make_setting(volume::make_phantom(options));
  const double cell = setting->extent().cell_mm();
  const auto I = std::make_shared<const Dark>(
      setting->make_model({.smoothing = {.sigma_mm = 0.4 * cell}})->intensity());
  const Triangles start = mesh::ball(Vector<3>::Zero(), kRadius, 2 * cell);
  const auto values = [&](double reach_cells) {
    const auto f = local_means<3>(*setting, I, start, {reach_cells * cell, cell, 0.01});
    Points<3> x(4, 3);
    x << 0.58, 0, 0, 0.62, 0, 0, 0, -0.59, 0, 0, -0.61, 0;
    Samples<3> samples;
    f->sample(x, Derivatives::kNone, samples);
    return Eigen::VectorXd(samples.value);
  };
  const Eigen::VectorXd near = values(8), far = values(40), farther = values(70);
  EXPECT_LT((far - near).cwiseAbs().maxCoeff(), 0.05)
      << far.transpose() << "; " << near.transpose();
  EXPECT_LT((farther - near).cwiseAbs().maxCoeff(), 0.05) << farther.transpose();
}

TEST(LocalMeans, HaveTheDerivativesOfTheirValues) {
  const Scene scene(kRadius - kVoxel, 0.2);
  constexpr double kStep = 1e-5;
  for (const Vector<3>& place : {Vector<3>(0.3, 0.35, 0.33), Vector<3>(-0.55, 0.1, 0.2)}) {
    Points<3> x(7, 3);
    x.rowwise() = place.transpose();
    for (int axis = 0; axis < 3; ++axis) {
      x(1 + 2 * axis, axis) += kStep;
      x(2 + 2 * axis, axis) -= kStep;
    }
    Samples<3> s;
    scene.f->sample(x, Derivatives::kSecond, s);
    for (int axis = 0; axis < 3; ++axis) {
      const double slope = (s.value[1 + 2 * axis] - s.value[2 + 2 * axis]) / (2 * kStep);
      EXPECT_NEAR(s.gradient(0, axis), slope, 1e-5 * (1 + std::abs(slope)));
      const auto second =
          ((s.gradient.row(1 + 2 * axis) - s.gradient.row(2 + 2 * axis)) / (2 * kStep)).eval();
      EXPECT_LT((s.hessian.row(0).segment(3 * axis, 3) - second).norm(),
                1e-4 * (1 + second.norm()));
    }
  }
}

TEST(LocalMeans, RefuseAStartBetweenTheNodes) {
  const Scene scene(kRadius);
  const Triangles dot =
      mesh::ball({0.3 * kVoxel, 0.3 * kVoxel, 0.3 * kVoxel}, 0.1 * kVoxel, 0.05 * kVoxel);
  EXPECT_THROW(local_means<3>(*scene.setting, scene.I, dot, {kVoxel, 0, 0.01}), UsageError);
}

}  // namespace
}  // namespace surf::segment
