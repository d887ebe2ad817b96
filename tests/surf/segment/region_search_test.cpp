#include "libsurf/segment/region_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

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
    const volume::Volume& volume, const Vector<3>& seed, const RegionSearchOptions& options = {},
    const std::function<bool(int, int)>& progress = [](int, int) { return true; }) {
  const SurfaceSetting setting(volume, volume::DerivativeFilter::kBSpline);
  const auto model = setting.make_model({.sigma_mm = 0.4});
  const std::vector<Vector<3>> seeds = {seed};
  const SeedModel seed_model = estimate_seed_model<3>(*model->intensity(), seeds, 1);
  return search_regions(*model->intensity(), setting.extent(), seed_model, seeds, options,
                        progress);
}

double share_at(const Region& region, const Vector<3>& point) {
  return volume::interpolate(region.share, region.share.world_to_index() * point);
}

TEST(RegionSearch, PutsTheObjectFirst) {
  const Vector<3> center(23, 25, 22);
  const auto regions =
      search(volume_of([&](const auto& x) { return is_in_ball(x, center, 14); }), center);
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(regions.front().volume_mm3), 14, kEdge);
  EXPECT_GT(share_at(regions.front(), center + Vector<3>(12, 0, 0)), 0.9);
}

TEST(RegionSearch, CutsNecksAndFillsHoles) {
  const Vector<3> left(12, 24, 24), right(36, 24, 24), hole(12, 27, 24);
  const volume::Volume volume = volume_of([&](const Vector<3>& x) {
    if (is_in_ball(x, hole, 1.5)) return 0.0;
    const bool is_neck = x[0] > 12 && x[0] < 36 && std::hypot(x[1] - 24, x[2] - 24) < 1.6;
    return double(is_in_ball(x, left, 9) || is_in_ball(x, right, 9) || is_neck);
  });
  const auto regions = search(volume, left);
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(regions.front().volume_mm3), 9, kEdge);
  EXPECT_GT(share_at(regions.front(), hole), 0.9);
  // The grid of the share ends where the region does.
  const Eigen::Vector3d far = regions.front().share.world_to_index() * right;
  EXPECT_TRUE((far.array() > regions.front().share.size()[0] - 1).any() ||
              share_at(regions.front(), right) < 0.1);
}

TEST(RegionSearch, FindsWhatTheScanCutsOff) {
  const Vector<3> center(0, 24, 24);
  const auto regions = search(volume_of([&](const auto& x) { return is_in_ball(x, center, 14); }),
                              Vector<3>(5, 24, 24));
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(radius_of_ball(2 * regions.front().volume_mm3), 14, kEdge);
}

TEST(RegionSearch, OffersRegionsThatDiffer) {
  // A ball in a shell in a larger ball.
  const Vector<3> center(24, 24, 24);
  const auto regions = search(volume_of([&](const Vector<3>& x) {
                                const double r = (x - center).norm();
                                return r < 8 ? 3.0 : r < 15 ? 2.0 : r < 21 ? 1.0 : -4.0;
                              }),
                              center);
  ASSERT_GE(regions.size(), 2u);
  for (std::size_t i = 1; i < regions.size(); ++i) {
    EXPECT_GE(regions[i - 1].score, regions[i].score);
    for (std::size_t j = 0; j < i; ++j) {
      const double smaller = std::min(regions[i].volume_mm3, regions[j].volume_mm3),
                   larger = std::max(regions[i].volume_mm3, regions[j].volume_mm3);
      EXPECT_LE(2 * smaller / (smaller + larger), RegionSearchOptions::kMostOverlap + 1e-9);
    }
  }
}

TEST(RegionSearch, TakesACoarserGridWhereItMust) {
  const Vector<3> center(23, 25, 22);
  const auto regions = search(volume_of([&](const auto& x) { return is_in_ball(x, center, 16); }),
                              center, {.max_nodes = 2e4});
  ASSERT_FALSE(regions.empty());
  EXPECT_NEAR(regions.front().share.voxel_size(), std::cbrt(std::pow(kSize, 3) / 2e4), 1e-9);
  EXPECT_NEAR(radius_of_ball(regions.front().volume_mm3), 16, regions.front().share.voxel_size());
}

TEST(RegionSearch, IsTheSameForAnyNumberOfThreads) {
  const Vector<3> center(23, 25, 22);
  const volume::Volume volume =
      volume_of([&](const Vector<3>& x) { return std::cos(0.3 * (x - center).norm()); });
  std::vector<std::vector<Region>> found;
  for (const int n : {1, 2}) {
    const ThreadLimit limit(n);
    found.push_back(search(volume, center));
  }
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t i = 0; i < found[0].size(); ++i) {
    EXPECT_EQ(found[0][i].score, found[1][i].score);
    EXPECT_EQ(found[0][i].volume_mm3, found[1][i].volume_mm3);
  }
}

TEST(RegionSearch, StopsOnRequest) {
  const Vector<3> center(24, 24, 24);
  int n_calls = 0;
  search(volume_of([&](const auto& x) { return is_in_ball(x, center, 14); }), center, {},
         [&](int, int all) {
           EXPECT_GT(all, 4);
           return ++n_calls < 2;
         });
  EXPECT_LE(n_calls, 4);  // those that had begun
}

TEST(RegionSearch, FindsNothingWhereAllIsTheSame) {
  const std::vector<float> values(20 * 20 * 20, 3.f);
  const volume::Volume volume({20, 20, 20}, Eigen::Affine3d::Identity(), values);
  EXPECT_TRUE(search(volume, {10, 10, 10}).empty());
}

}  // namespace
}  // namespace surf::segment
