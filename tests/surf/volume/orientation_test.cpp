#include "libsurf/volume/orientation.h"

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

}  // namespace
}  // namespace surf::volume
