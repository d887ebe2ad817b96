#include "libsurf/mesh/from_label_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;

volume::Volume random_mask(const std::array<int, 3>& size, unsigned seed, int percent) {
  std::vector<float> values(std::size_t(size[0]) * size[1] * size[2]);
  for (float& value : values) {
    seed = seed * 1664525u + 1013904223u;
    value = (seed >> 8) % 100 < unsigned(percent) ? 3 : 0;
  }
  return {size, Eigen::Affine3d::Identity(), values};
}

/// The surface passes, and is the inverse of rasterising.
void expect_good_surface(const volume::Volume& mask) {
  const Triangles surface = surface_of_label_map(mask);
  const Verification found = verify(surface);
  ASSERT_TRUE(found.passed()) << found.message();
  const auto back = rasterize(surface, mask.size(), mask.index_to_world());
  std::size_t at = 0;
  for (int k = 0; k < mask.size()[2]; ++k)
    for (int j = 0; j < mask.size()[1]; ++j)
      for (int i = 0; i < mask.size()[0]; ++i, ++at)
        ASSERT_EQ(back[at] != 0, mask.value(i, j, k) != 0) << i << ' ' << j << ' ' << k;
}

TEST(SurfaceOfLabelMap, PassesForEveryMaskOfTwoByTwoByTwo) {
  for (int mask = 1; mask < 256; ++mask) {
    std::array<float, 8> values;
    for (int c = 0; c < 8; ++c) values[c] = float(mask >> c & 1);
    SCOPED_TRACE(mask);
    expect_good_surface({{2, 2, 2}, Eigen::Affine3d::Identity(), values});
  }
}

TEST(SurfaceOfLabelMap, PassesForNoise) {
  for (const int percent : {10, 30, 50, 70, 90}) {
    SCOPED_TRACE(percent);
    expect_good_surface(random_mask({14, 13, 12}, 77, percent));
  }
}

/// A function of the distance from the middle.
volume::Volume volume_of_distances(const Eigen::Affine3d& affine,
                                   const std::function<double(double)>& value) {
  const std::array<int, 3> size{60, 48, 40};
  const Vector<3> center = affine * Vector<3>(29.5, 23.5, 19.5);
  std::vector<float> values;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        values.push_back(float(value((affine * Vector<3>(i, j, k) - center).norm())));
  return {size, affine, values};
}

volume::Volume ball_labels(const Eigen::Affine3d& affine, double radius) {
  return volume_of_distances(affine, [=](double r) { return r <= radius ? 2.0 : 7.0; });
}

TEST(SurfaceOfLabelMap, IsPlacedByTheWholeAffine) {
  for (const double mirror : {1.0, -1.0}) {
    Eigen::Affine3d affine = Eigen::Translation3d(5, -40, 90) *
                             Eigen::AngleAxisd(0.6, Eigen::Vector3d(3, 1, 2).normalized()) *
                             Eigen::Scaling(0.5 * mirror, 0.6, 0.8);
    affine.linear().col(2) += 0.2 * affine.linear().col(1);
    const Triangles surface = surface_of_label_map(ball_labels(affine, 12), 2);
    const Verification found = verify(surface);
    EXPECT_TRUE(found.passed()) << found.message();
    const Vector<3> center = affine * Vector<3>(29.5, 23.5, 19.5);
    const DistanceStatistics distance =
        distances_from(surface, [&](const Vector<3>& p) { return (p - center).norm() - 12; });
    constexpr double kHalfDiagonal = 0.6;  // of a voxel [mm]
    EXPECT_LT(distance.max_mm, kHalfDiagonal);
    EXPECT_LT(distance.mean_mm, 0.2);
    EXPECT_NEAR(distance.signed_mean_mm, 0, 0.03);
    constexpr double kLattice = 0.01;
    EXPECT_NEAR(volume_mm3(surface) / (4 * std::numbers::pi / 3 * std::pow(12, 3)), 1, kLattice);
  }
}

TEST(SurfaceOfLabelMap, ChoosesTheLabelAndCapsItAtTheBorder) {
  const volume::Volume labels = ball_labels(Eigen::Affine3d::Identity(), 12);
  const double box = 60 * 48 * 40, ball = volume_mm3(surface_of_label_map(labels, 2));
  const Triangles rest = surface_of_label_map(labels, 7);
  EXPECT_TRUE(verify(rest).passed());
  constexpr double kBevels = 0.01;  // edges of the box are cut off
  EXPECT_NEAR(volume_mm3(rest) / (box - ball), 1, kBevels);
  EXPECT_NEAR(volume_mm3(surface_of_label_map(labels)) / box, 1, kBevels);
  EXPECT_THROW(surface_of_label_map(labels, 1), InputError);
  EXPECT_THROW(surface_of_label_map(labels, 614454277), InputError);  // not told from others
}

/// radius - |x - center|.
volume::Volume ball_depths(const Eigen::Affine3d& affine, double radius) {
  return volume_of_distances(affine, [=](double r) { return radius - r; });
}

TEST(SurfaceOfLevel, LiesWhereTheValuesReachIt) {
  for (const double mirror : {1.0, -1.0}) {
    const Eigen::Affine3d affine = Eigen::Translation3d(5, -40, 90) *
                                   Eigen::AngleAxisd(0.6, Eigen::Vector3d(3, 1, 2).normalized()) *
                                   Eigen::Scaling(0.5 * mirror, 0.6, 0.8);
    const Triangles surface = surface_of_level(ball_depths(affine, 12), 2);
    const Verification found = verify(surface);
    EXPECT_TRUE(found.passed()) << found.message();
    const Vector<3> center = affine * Vector<3>(29.5, 23.5, 19.5);
    constexpr double kLeastFraction = 0.05 * 0.8;  // of an edge, from its ends [mm]
    for (const auto point : surface.points.rowwise())
      EXPECT_NEAR((point.transpose() - center).norm(), 10, kLeastFraction + 0.01);
  }
}

TEST(SurfaceOfLevel, PassesForSmoothNoise) {
  std::vector<float> values(20 * 18 * 16);
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = float(std::sin(0.9 * double(at % 20)) + std::sin(0.8 * double(at / 20 % 18)) +
                       std::sin(0.7 * double(at / 360)));
  const volume::Volume volume({20, 18, 16}, Eigen::Affine3d::Identity(), values);
  for (const double level : {-1.0, 0.0, 1.5}) {
    const Verification found = verify(surface_of_level(volume, level));
    EXPECT_TRUE(found.passed()) << level << ": " << found.message();
  }
  EXPECT_EQ(surface_of_level(volume, 4).elements.rows(), 0);
}

TEST(SurfaceOfLabelMap, SkipsEmptySlicesBetweenParts) {
  std::vector<float> values(4 * 4 * 30);
  for (const int k : {2, 3, 15, 29}) values[(k * 4 + 1) * 4 + 2] = 1;
  const volume::Volume labels({4, 4, 30}, Eigen::Affine3d::Identity(), values);
  EXPECT_EQ(verify(surface_of_label_map(labels)).n_components, 3);
  expect_good_surface(labels);
}

}  // namespace
}  // namespace surf::mesh
