#include "libsurf/mesh/overlap.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/measure.h"
#include "tests/surf/mesh/check_shapes.h"
#include "tests/surf/message_of.h"

namespace surf::mesh {
namespace {

using namespace surf::test;

/// 2 within the box, 0 elsewhere: voxels 2 .. 5 of 8 along each axis.
volume::Volume box_labels(const Eigen::Affine3d& affine) {
  std::vector<float> values;
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i)
        values.push_back(std::min({i, j, k}) >= 2 && std::max({i, j, k}) <= 5 ? 2.0f : 0.0f);
  return {{8, 8, 8}, affine, values};
}

/// The cube [1.5, 5.5]^3 of voxels in index space, moved by some voxels.
Triangles voxel_box(const Eigen::Affine3d& affine, const Vector<3>& by) {
  return moved(cube(),
               affine * Eigen::Translation3d(by + Vector<3>::Constant(1.5)) * Eigen::Scaling(4.0));
}

Eigen::Affine3d mirrored_affine() {
  return Eigen::Affine3d(Eigen::Translation3d(3, 4, 5) *
                         Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()) *
                         Eigen::Scaling(-0.5, 0.5, 2.0));
}

TEST(Overlap, OfTheVoxelsOwnBoxIsOne) {
  for (const Eigen::Affine3d& affine : {Eigen::Affine3d::Identity(), mirrored_affine()}) {
    const Overlap found = overlap(voxel_box(affine, {0, 0, 0}), box_labels(affine), 2);
    EXPECT_DOUBLE_EQ(found.dice(), 1);
    EXPECT_DOUBLE_EQ(found.jaccard(), 1);
    EXPECT_NEAR(found.first_mm3, 64 * std::abs(affine.linear().determinant()), 1e-12);
  }
}

TEST(Overlap, OfBoxesHalfAVoxelApartIsKnown) {
  const Eigen::Affine3d affine = mirrored_affine();
  const Overlap found = overlap(voxel_box(affine, {0.5, 0, 0}), box_labels(affine), {}, 2);
  EXPECT_DOUBLE_EQ(found.dice(), 3.5 / 4);
  EXPECT_DOUBLE_EQ(found.jaccard(), 3.5 / 4.5);
}

TEST(Overlap, OfALabelsOwnSurfaceIsOne) {
  const volume::Volume labels = box_labels(mirrored_affine());
  EXPECT_EQ(overlap(surface_of_label_map(labels), labels, 2).dice(), 1);
  EXPECT_LT(overlap(surface_of_label_map(labels), labels, 2, 2).dice(), 1);  // corners cut off
}

TEST(Overlap, CountsWhatLiesOutsideTheVolume) {
  const Eigen::Affine3d affine = Eigen::Affine3d::Identity();
  const Overlap found = overlap(voxel_box(affine, {3, 3, 3}), box_labels(affine), 2);
  EXPECT_DOUBLE_EQ(found.first_mm3, 64);
  EXPECT_DOUBLE_EQ(found.second_mm3, 64);
  EXPECT_DOUBLE_EQ(found.common_mm3, 1);
  EXPECT_EQ(overlap(voxel_box(affine, {30, 0, 0}), box_labels(affine), 2).dice(), 0);
  EXPECT_EQ(overlap(voxel_box(affine, {0, 0, 0}), box_labels(affine), 9).dice(), 0);
}

TEST(Overlap, RefusesASurfaceInAnotherUnit) {
  const Eigen::Affine3d affine = Eigen::Affine3d::Identity();
  const volume::Volume labels = box_labels(affine);
  const auto message = [&](const Triangles& surface) {
    return message_of<InputError>([&] { overlap(surface, labels, 2); });
  };
  const auto scaled = [](double x, double y, double z) {
    return moved(cube(), Eigen::Affine3d(Eigen::Scaling(x, y, z)));
  };
  EXPECT_EQ(message(scaled(1e5, 2e5, 1e5)),
            "the surface spans the voxels (0, 0, 0) to (1e+05, 2e+05, 1e+05) of the label map, "
            "which has 8 x 8 x 8: too many to compare; is it in another unit or space?");
  EXPECT_NE(message(scaled(2e9, 1, 1)).find("(0, 0, 0) to (2e+09, 1, 1)"), std::string::npos);
  EXPECT_NE(message(moved(cube(), {-1e300, 0, 0})).find("too far away"), std::string::npos);
  // One slice that takes all of the memory, five bytes a voxel.
  const double n = usable_memory() / 5, side = std::sqrt(n);
  if (n > 9e9) GTEST_SKIP() << "so much memory that the number of voxels is what it fails on";
  EXPECT_NE(message(scaled(side, side, 0.4)).find(usable_memory_text()), std::string::npos);
}

TEST(Overlap, OfTwoSurfacesIsKnown) {
  const Triangles one = moved(cube(), Eigen::Affine3d(Eigen::Scaling(10.0)));
  EXPECT_DOUBLE_EQ(overlap(one, one).dice(), 1);
  constexpr double kSampling = 1.0 / 256;  // one layer of samples
  EXPECT_NEAR(overlap(one, moved(one, {5, 0, 0})).dice(), 0.5, kSampling);
  EXPECT_NEAR(overlap(one, moved(one, {5, 0, 0})).jaccard(), 1.0 / 3, kSampling);
  EXPECT_EQ(overlap(one, moved(one, {20, 0, 0})).dice(), 0);
}

// Thinner than the distance of points that are as far apart along all axes.
TEST(Overlap, OfThinPlatesIsKnown) {
  const Triangles plate = moved(cube(), Eigen::Affine3d(Eigen::Scaling(200.0, 200.0, 0.5)));
  const Overlap found = overlap(plate, moved(plate, {0, 0, 0.25}));
  constexpr double kSampling = 1.0 / 85;  // one layer of samples in what they share
  EXPECT_NEAR(found.dice(), 0.5, kSampling);
  EXPECT_NEAR(found.first_mm3 / 20000, 1, kSampling);
}

TEST(Overlap, OfConcentricBallsIsTheirVolumes) {
  const Triangles small = sphere({1, 2, 3}, 4, 5), big = sphere({1, 2, 3}, 5, 5);
  const double v = volume_mm3(small), w = volume_mm3(big);
  constexpr double kSampling = 1e-3;
  EXPECT_NEAR(overlap(small, big).dice(), 2 * v / (v + w), kSampling);
  EXPECT_NEAR(overlap(small, big).second_mm3 / w, 1, kSampling);
}

}  // namespace
}  // namespace surf::mesh
