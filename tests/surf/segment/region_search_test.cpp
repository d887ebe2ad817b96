#include "libsurf/segment/region_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "libsurf/base/threads.h"
#include "libsurf/segment/surface_setting.h"
#include "libsurf/volume/interpolate.h"

namespace surf::segment {
namespace {

constexpr int kSize = 48;

/// Voxels of 1 mm with the values of a function of the index, and a little noise.
volume::Volume volume_of(const std::function<double(const Vector<3>&)>& value) {
  std::vector<float> values;
  unsigned state = 5;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        state = state * 1664525u + 1013904223u;
        values.push_back(float(value({double(i), double(j), double(k)}) +
                               0.1 * ((state >> 8) % 1000 / 1000.0 - 0.5)));
      }
  return {{kSize, kSize, kSize}, Eigen::Affine3d::Identity(), values};
}

bool is_in_ball(const Vector<3>& x, const Vector<3>& center, double radius) {
  return (x - center).norm() <= radius;
}

double radius_of_ball(double volume) { return std::cbrt(3 / (4 * std::numbers::pi) * volume); }

/// The widest window before the leak reaches to the foot of the edge.
constexpr double kEdge = 1;

std::vector<Region> search(
    const volume::Volume& volume, const std::vector<Vector<3>>& seeds,
    const RegionSearchOptions& options = {},
    const std::function<bool(int)>& progress = [](int) { return true; }) {
  const SurfaceSetting setting(volume, volume::DerivativeFilter::kBSpline);
  const auto model = setting.make_model({.sigma_mm = 0.4 * volume.voxel_size()});
  const auto [lowest, highest] = volume.range();
  std::vector<SeedModel> models;
  for (const Vector<3>& seed : seeds) {
    models.push_back(estimate_seed_model<3>(*model->intensity(), std::vector<Vector<3>>{seed},
                                            volume.voxel_size()));
    models.back().deviation = std::max(models.back().deviation, (highest - lowest) / 4096.0);
  }
  return search_regions(*model->intensity(), setting.extent(), models, seeds, options, progress);
}

/// [mm^3], from the shares.
double volume_of(const Region& region) {
  std::vector<float> shares(region.share.n_voxels());
  region.share.copy_box({0, 0, 0}, region.share.size(), shares.data());
  return std::pow(region.share.voxel_size(), 3) *
         std::accumulate(shares.begin(), shares.end(), 0.0);
}

/// 0 where the region's grid has ended.
double share_at(const Region& region, const Vector<3>& point) {
  const double share = volume::interpolate(region.share, region.share.world_to_index() * point);
  return std::isnan(share) ? 0 : share;
}

TEST(RegionSearch, PutsTheObjectFirst) {
  const Vector<3> center(23, 25, 22);
  const auto regions =
      search(volume_of([&](const auto& x) { return is_in_ball(x, center, 14); }), {center});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(volume_of(regions.front())), 14, kEdge);
  EXPECT_GT(share_at(regions.front(), center + Vector<3>(12, 0, 0)), 0.9);
}

TEST(RegionSearch, CutsNecksAndFillsHoles) {
  const Vector<3> left(12, 24, 24), right(36, 24, 24), hole(12, 27, 24);
  const volume::Volume volume = volume_of([&](const Vector<3>& x) {
    if (is_in_ball(x, hole, 1.5)) return 0.0;
    const bool is_neck = x[0] > 12 && x[0] < 36 && std::hypot(x[1] - 24, x[2] - 24) < 1.6;
    return double(is_in_ball(x, left, 9) || is_in_ball(x, right, 9) || is_neck);
  });
  const auto regions = search(volume, {left});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(volume_of(regions.front())), 9, kEdge);
  EXPECT_GT(share_at(regions.front(), hole), 0.9);
  EXPECT_LT(share_at(regions.front(), right), 0.1);
}

TEST(RegionSearch, FindsWhatTheScanCutsOff) {
  const Vector<3> center(0, 24, 24);
  const auto regions = search(volume_of([&](const auto& x) { return is_in_ball(x, center, 14); }),
                              {Vector<3>(5, 24, 24)});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(2 * volume_of(regions.front())), 14, kEdge);
}

TEST(RegionSearch, OffersRegionsThatDiffer) {
  // A ball in a shell in a larger ball.
  const Vector<3> center(24, 24, 24);
  const auto regions = search(volume_of([&](const Vector<3>& x) {
                                const double r = (x - center).norm();
                                return r < 8 ? 3.0 : r < 15 ? 2.0 : r < 21 ? 1.0 : -4.0;
                              }),
                              {center});
  ASSERT_GE(regions.size(), 2u);
  for (std::size_t i = 1; i < regions.size(); ++i) {
    EXPECT_GE(regions[i - 1].score, regions[i].score);
    for (std::size_t j = 0; j < i; ++j) {
      const double smaller = std::min(volume_of(regions[i]), volume_of(regions[j])),
                   larger = std::max(volume_of(regions[i]), volume_of(regions[j]));
      EXPECT_LE(2 * smaller / (smaller + larger), RegionSearchOptions::kMostOverlap + 0.02);
    }
  }
}

TEST(RegionSearch, TakesACoarserGridWhereItMust) {
  const Vector<3> center(23, 25, 22);
  const auto regions = search(volume_of([&](const auto& x) { return is_in_ball(x, center, 16); }),
                              {center}, {.max_nodes = 2e4});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(regions.front().share.voxel_size(), std::cbrt(std::pow(kSize, 3) / 2e4), 0.1);
  EXPECT_NEAR(radius_of_ball(volume_of(regions.front())), 16, regions.front().share.voxel_size());
}

TEST(RegionSearch, IsTheSameForAnyNumberOfThreads) {
  const Vector<3> center(23, 25, 22);
  const volume::Volume volume =
      volume_of([&](const Vector<3>& x) { return std::cos(0.3 * (x - center).norm()); });
  std::vector<std::vector<Region>> found;
  for (const int n : {1, 2}) {
    const ThreadLimit limit(n);
    found.push_back(search(volume, {center}));
  }
  ASSERT_FALSE(found[0].empty());
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t i = 0; i < found[0].size(); ++i) {
    EXPECT_EQ(found[0][i].score, found[1][i].score);
    EXPECT_EQ(volume_of(found[0][i]), volume_of(found[1][i]));
  }
}

TEST(RegionSearch, StopsOnRequestAndJudgesWhatItHas) {
  const Vector<3> center(24, 24, 24);
  const volume::Volume volume = volume_of([&](const auto& x) { return is_in_ball(x, center, 14); });
  int n_windows = 0, n_calls = 0;
  search(volume, {center}, {}, [&](int n_done) { return (n_windows = n_done) > 0; });
  ASSERT_GT(n_windows, 4);
  const auto stopped = search(volume, {center}, {}, [&](int) { return ++n_calls < n_windows - 1; });
  EXPECT_FALSE(stopped.empty());
  EXPECT_EQ(n_calls, n_windows - 1);
}

TEST(RegionSearch, TakesSeedsInObjectsOfDifferentIntensity) {
  const Vector<3> left(12, 24, 24), right(36, 24, 24);
  const auto regions = search(volume_of([&](const Vector<3>& x) {
                                return is_in_ball(x, left, 9) ? 3.0 : is_in_ball(x, right, 9);
                              }),
                              {left, right});
  ASSERT_FALSE(regions.empty());
  for (const Vector<3>& inside : {left, right}) EXPECT_GT(share_at(regions.front(), inside), 0.9);
  EXPECT_LT(share_at(regions.front(), {24, 24, 38}), 0.1);
}

TEST(RegionSearch, WorksOnTwoSlices) {
  std::vector<float> values;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 60; ++i)
        values.push_back(std::hypot(i - 30, j - 28) < 15 ? 1.f : float((i * 7 + j * 13) % 5) / 50);
  const volume::Volume volume({60, 60, 2}, Eigen::Affine3d::Identity(), values);
  const auto regions = search(volume, {Vector<3>(30, 28, 0.5)});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(std::sqrt(volume_of(regions.front()) / (2 * std::numbers::pi)), 15, kEdge);
}

TEST(RegionSearch, KnowsTheShearOfAVolume) {
  Eigen::Affine3d sheared = Eigen::Affine3d::Identity();
  sheared(1, 2) = 0.45;
  const Vector<3> center = sheared * Vector<3>(24, 24, 24);
  std::vector<float> values;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i)
        values.push_back(
            is_in_ball(sheared * Vector<3>(i, j, k), center, 13) ? 1.f : 0.01f * float(i % 3));
  const auto regions = search({{kSize, kSize, kSize}, sheared, values}, {center});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(volume_of(regions.front())), 13, kEdge);
}

TEST(RegionSearch, FindsNothingWhereAllIsTheSame) {
  const std::vector<float> values(20 * 20 * 20, 3.f);
  const volume::Volume volume({20, 20, 20}, Eigen::Affine3d::Identity(), values);
  EXPECT_TRUE(search(volume, {Vector<3>(10, 10, 10)}).empty());
}

}  // namespace
}  // namespace surf::segment
