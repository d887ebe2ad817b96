#include "libsurf/volume/interpolate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

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

TEST(Interpolate, IsExactForWhatIsLinearInEachIndex) {
  const Volume volume = some_volume();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d at(3 * share(random), 4 * share(random), 2 * share(random));
    EXPECT_NEAR(interpolate(volume, at), multilinear(at), 1e-12);
  }
}

TEST(Interpolate, TakesVoxelsToTheLastAndNothingBeyond) {
  const Volume volume = some_volume();
  EXPECT_EQ(interpolate(volume, {0, 0, 0}), multilinear({0, 0, 0}));
  EXPECT_EQ(interpolate(volume, {3, 4, 2}), multilinear({3, 4, 2}));
  EXPECT_NEAR(interpolate(volume, {3 + 1e-10, 4, 2}), multilinear({3, 4, 2}), 1e-8);
  for (int axis = 0; axis < 3; ++axis)
    for (const double beyond : {-1e-6, kSize[axis] - 1 + 1e-6}) {
      Eigen::Vector3d at(1, 1, 1);
      at[axis] = beyond;
      EXPECT_TRUE(std::isnan(interpolate(volume, at))) << at.transpose();
    }
  EXPECT_TRUE(std::isnan(interpolate(volume, {NAN, 1, 1})));
}

}  // namespace
}  // namespace surf::volume
