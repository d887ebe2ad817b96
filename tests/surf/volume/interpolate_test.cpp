#include "libsurf/volume/interpolate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "libsurf/volume/phantom.h"

namespace surf::volume {
namespace {

constexpr std::array<int, 3> kSize = {4, 5, 3};

/// Linear in each index, with all products, and exact in floats at the voxels.
double multilinear(const Eigen::Vector3d& x) {
  return 3 + x[0] - 2 * x[1] + 4 * x[2] + x[0] * x[1] - 3 * x[1] * x[2] + 2 * x[0] * x[2] -
         x[0] * x[1] * x[2];
}

Volume some_volume() {
  std::vector<float> values;
  for (int k = 0; k < kSize[2]; ++k)
    for (int j = 0; j < kSize[1]; ++j)
      for (int i = 0; i < kSize[0]; ++i)
        values.push_back(float(multilinear({double(i), double(j), double(k)})));
  return {kSize, Eigen::Affine3d(Eigen::Scaling(0.5)), values};
}

double at_one(const Volume& volume, const Eigen::Vector3d& index) {
  return interpolate(volume, std::span(&index, 1)).front();
}

TEST(Interpolate, IsExactForWhatIsLinearInEachIndex) {
  const Volume volume = some_volume();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d at(3 * share(random), 4 * share(random), 2 * share(random));
    EXPECT_NEAR(at_one(volume, at), multilinear(at), 1e-12);
  }
}

TEST(Interpolate, TakesVoxelsToTheLastAndNothingBeyond) {
  const Volume volume = some_volume();
  EXPECT_EQ(at_one(volume, {0, 0, 0}), multilinear({0, 0, 0}));
  EXPECT_EQ(at_one(volume, {3, 4, 2}), multilinear({3, 4, 2}));
  EXPECT_NEAR(at_one(volume, {3 + 1e-10, 4, 2}), multilinear({3, 4, 2}), 1e-8);
  for (int axis = 0; axis < 3; ++axis)
    for (const double beyond : {-1e-6, kSize[axis] - 1 + 1e-6}) {
      Eigen::Vector3d at(1, 1, 1);
      at[axis] = beyond;
      EXPECT_TRUE(std::isnan(at_one(volume, at))) << at.transpose();
    }
  EXPECT_TRUE(std::isnan(at_one(volume, {NAN, 1, 1})));
}

TEST(Interpolate, GivesTheSameForPointsNearAndFarFromEachOther) {
  PhantomOptions options;
  options.size = {40, 50, 30};
  options.noise = 0.2;
  const Volume volume = make_phantom(options);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(-0.05, 1.05);
  std::vector<Eigen::Vector3d> indices;
  for (int n = 0; n < 500; ++n)  // anywhere, some outside
    indices.emplace_back(39 * share(random), 49 * share(random), 29 * share(random));
  for (int n = 0; n < 2000; ++n)  // an oblique plane
    indices.emplace_back(n % 50 * 0.7, n / 50 * 0.6 + n % 50 * 0.3, n % 50 * 0.2 + n / 50 * 0.3);
  const std::vector<double> values = interpolate(volume, indices);
  ASSERT_EQ(values.size(), indices.size());
  int n_outside = 0;
  for (std::size_t n = 0; n < indices.size(); ++n) {
    const double alone = at_one(volume, indices[n]);
    n_outside += std::isnan(alone);
    EXPECT_TRUE(values[n] == alone || (std::isnan(values[n]) && std::isnan(alone))) << n;
  }
  EXPECT_GT(n_outside, 50);
  EXPECT_LT(n_outside, 500);
  EXPECT_TRUE(interpolate(volume, {}).empty());
}

}  // namespace
}  // namespace surf::volume
