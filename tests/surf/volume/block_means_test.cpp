#include "libsurf/volume/detail/block_means.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <random>
#include <vector>

#include "libsurf/base/index_box.h"

namespace surf::volume {
namespace {

using Index = std::array<int, 3>;
constexpr Index kSize = {11, 9, 21}, kBlock = {3, 2, 5};

std::vector<float> random_values() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(-50, 200);
  std::vector<float> out(IndexBox<3>{{}, kSize}.n());
  for (float& v : out) v = value(random);
  return out;
}

Volume means_of(const std::vector<float>& values, const Eigen::Affine3d& index_to_world) {
  constexpr int kSlab = 8;
  const std::size_t slice = std::size_t(kSize[0]) * kSize[1];
  BlockMeans means(kSize, index_to_world, kBlock, {});
  for (int k = 0; k < kSize[2]; k += kSlab)
    means.add(std::span(values).subspan(k * slice, std::min(kSlab, kSize[2] - k) * slice), k);
  return means.finish();
}

Eigen::Affine3d affine(double x, double y, double z) {
  return Eigen::Translation3d(4, -5, 6) * Eigen::Affine3d(Eigen::Scaling(x, y, z));
}

TEST(BlockMeans, AreThoseOfTheVoxelsInEachBlock) {
  const std::vector<float> values = random_values();
  const IndexBox<3> voxels{{}, kSize};
  for (const auto& to_world :
       {affine(1, 1, 1), affine(-0.8, 1, 2), affine(1, -1, -3), affine(-1, -2, -1)}) {
    const Volume means = means_of(values, to_world);
    ASSERT_EQ(means.size(), (Index{4, 5, 5}));
    const IndexBox<3> blocks{{}, means.size()};
    std::vector<double> sums(blocks.n()), counts(blocks.n());
    const Eigen::Affine3d to_block = means.world_to_index() * to_world;
    for (std::size_t at = 0; at < voxels.n(); ++at) {
      const Index voxel = voxels.node(at);
      const Eigen::Array3d place = to_block * Eigen::Vector3d(voxel[0], voxel[1], voxel[2]);
      const Eigen::Array3i block = place.round().cast<int>();
      const std::size_t to = blocks.at({block[0], block[1], block[2]});
      sums[to] += values[at];
      ++counts[to];
    }
    for (std::size_t at = 0; at < blocks.n(); ++at) {
      const Index block = blocks.node(at);
      EXPECT_FLOAT_EQ(means.value(block[0], block[1], block[2]), float(sums[at] / counts[at]));
    }
  }
}

// The order in which a file has its axes is an accident.
TEST(BlockMeans, AreTheSameWhereTheFileRunsTheOtherWay) {
  const std::vector<float> values = random_values();
  const IndexBox<3> voxels{{}, kSize};
  std::vector<float> turned(values.size());
  for (std::size_t at = 0; at < voxels.n(); ++at) {
    const auto [i, j, k] = voxels.node(at);
    turned[voxels.at({kSize[0] - 1 - i, j, kSize[2] - 1 - k})] = values[at];
  }
  const Eigen::Affine3d to_world = affine(1, 1, 2);
  const Eigen::Affine3d turned_to_world = to_world *
                                          Eigen::Translation3d(kSize[0] - 1, 0, kSize[2] - 1) *
                                          Eigen::Scaling(-1.0, 1.0, -1.0);
  const Volume a = means_of(values, to_world).in_ras_order(),
               b = means_of(turned, turned_to_world).in_ras_order();
  EXPECT_TRUE(a.index_to_world().isApprox(b.index_to_world()));
  ASSERT_EQ(a.size(), b.size());
  for (int k = 0; k < a.size()[2]; ++k)
    for (int j = 0; j < a.size()[1]; ++j)
      for (int i = 0; i < a.size()[0]; ++i) EXPECT_EQ(a.value(i, j, k), b.value(i, j, k));
}

TEST(BlockMeans, OfOneValueHaveItToTheBit) {
  const Volume means =
      means_of(std::vector<float>(IndexBox<3>{{}, kSize}.n(), 0.1f), affine(1, 1, 1));
  EXPECT_EQ(means.range(), (std::array<float, 2>{0.1f, 0.1f}));
}

TEST(BlockSize, MakesCubesOfAboutFourMillion) {
  EXPECT_EQ(block_size({1024, 1024, 1024}, affine(1, 1, 1)), (Index{6, 6, 6}));
  EXPECT_EQ(block_size({1024, 1024, 1024}, affine(0.01, -0.01, 0.01)), (Index{6, 6, 6}));
  EXPECT_EQ(block_size({1000, 1000, 100}, affine(0.5, 0.5, 3)), (Index{5, 5, 1}));
}

TEST(BlockSize, LeavesSmallVolumesAlone) {
  EXPECT_EQ(block_size({512, 512, 300}, affine(0.8, 0.8, 1)), std::nullopt);
  EXPECT_EQ(block_size({2, 2, 2}, affine(1, 1, 1)), std::nullopt);
}

// A plate of 2^29 voxels, 2 of them thick, has two blocks through it.
TEST(BlockSize, LeavesTwoBlocksAlongEachAxis) {
  const auto block = block_size({2, 65536, 4096}, affine(1, 1, 1));
  ASSERT_TRUE(block);
  EXPECT_EQ((*block)[0], 1);
}

}  // namespace
}  // namespace surf::volume
