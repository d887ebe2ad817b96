#include "libsurf/volume/orientation.h"

#include <algorithm>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

constexpr double kRoundingDeg = 1e-9;

TEST(Orientation, CodeSaysWhereTheIndicesRunTo) {
  EXPECT_EQ(orientation_of(Eigen::Affine3d::Identity()).code, "RAS");
  Eigen::Matrix3d linear;
  linear << 0, 0, -2, 0, 3, 0, -1, 0, 0;  // i to I, j to A, k to L
  const Orientation orientation = orientation_of(affine(linear, {1, 2, 3}));
  EXPECT_EQ(orientation.code, "IAL");
  EXPECT_TRUE(orientation.is_mirrored);
  EXPECT_NEAR(orientation.oblique_deg, 0, kRoundingDeg);
  EXPECT_NEAR(orientation.shear_deg, 0, kRoundingDeg);
}

TEST(Orientation, PitchIsReportedAsItsAngle) {
  const Eigen::Matrix3d pitch =
      Eigen::AngleAxisd(16.5 * M_PI / 180, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Orientation orientation = orientation_of(affine(pitch, {0, 0, 0}));
  EXPECT_EQ(orientation.code, "RAS");
  EXPECT_NEAR(orientation.oblique_deg, 16.5, kRoundingDeg);
  EXPECT_NEAR(orientation.shear_deg, 0, kRoundingDeg);
}

TEST(Orientation, ShearIsTheAngleMissingTo90Degrees) {
  Eigen::Matrix3d tilted = Eigen::Matrix3d::Identity();
  tilted(1, 2) = 5 * std::tan(10 * M_PI / 180);
  tilted(2, 2) = 5;
  EXPECT_NEAR(orientation_of(affine(tilted, {0, 0, 0})).shear_deg, 10, kRoundingDeg);
}

TEST(Orientation, BoundsHoldEveryCornerAndTouchSome) {
  for (const Grid& grid : grids()) {
    const auto [lower, upper] = bounds_ras_mm(grid.index_to_world, grid.size);
    Eigen::Vector3d least = upper, most = lower;
    for (int i : {0, grid.size[0] - 1})
      for (int j : {0, grid.size[1] - 1})
        for (int k : {0, grid.size[2] - 1}) {
          const Eigen::Vector3d corner = grid.index_to_world * Eigen::Vector3d(i, j, k);
          least = least.cwiseMin(corner);
          most = most.cwiseMax(corner);
        }
    EXPECT_EQ(least, lower);
    EXPECT_EQ(most, upper);
  }
}

TEST(Orientation, RasOrderIsTheSameVolumeHoweverTheFileHasItsAxes) {
  const std::array<int, 3> size = {5, 4, 3};
  const Eigen::Matrix3d linear =
      Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() *
      Eigen::Vector3d(0.7, 0.9, 2.0).asDiagonal();
  const Eigen::Affine3d at = affine(linear, {-27.1, 13.2, 4.3});
  std::vector<float> values(60);
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = float(n * n % 97);
  const Volume ras = Volume(size, at, values).in_ras_order();
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips) {
      // Axis n of the file runs along axes[n] of the volume, or against it.
      std::array<int, 3> file_size;
      Eigen::Affine3d to_volume = Eigen::Affine3d::Identity();
      to_volume.linear().setZero();
      for (int n = 0; n < 3; ++n) {
        const bool is_reversed = flips >> n & 1;
        file_size[n] = size[axes[n]];
        to_volume.linear()(axes[n], n) = is_reversed ? -1 : 1;
        if (is_reversed) to_volume.translation()[axes[n]] = size[axes[n]] - 1;
      }
      std::vector<float> stored;
      for (int k = 0; k < file_size[2]; ++k)
        for (int j = 0; j < file_size[1]; ++j)
          for (int i = 0; i < file_size[0]; ++i) {
            const Eigen::Vector3d index = to_volume * Eigen::Vector3d(i, j, k);
            stored.push_back(values[std::size_t(index[0] + 5 * index[1] + 20 * index[2])]);
          }
      Eigen::Affine3d as_floats = at * to_volume;
      as_floats.matrix() = as_floats.matrix().cast<float>().cast<double>().eval();
      const Volume file(file_size, as_floats, stored);
      const Volume again = file.in_ras_order();
      EXPECT_EQ(again.size(), size);
      EXPECT_EQ(again.index_to_world().translation(), ras.index_to_world().translation());
      std::vector<float> all(60), beyond(4 * 4 * 4), expected(4 * 4 * 4);
      again.copy_box({0, 0, 0}, size, all.data());
      EXPECT_EQ(all, values) << flips;
      again.copy_box({-1, 2, 1}, {3, 6, 5}, beyond.data());
      ras.copy_box({-1, 2, 1}, {3, 6, 5}, expected.data());
      EXPECT_EQ(beyond, expected);
      EXPECT_EQ(again.value(4, 2, 1), values[4 + 10 + 20]);
      EXPECT_EQ(again.in_ras_order().size(), size);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
}

}  // namespace
}  // namespace surf::volume
