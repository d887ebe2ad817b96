#include "libsurf/volume/distance_transform.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace surf::volume {
namespace {

float nearest(const std::array<int, 3>& size, const std::vector<std::uint8_t>& set, int i, int j,
              int k) {
  float least = kInfiniteDistance;
  std::size_t at = 0;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x, ++at)
        if (set[at])
          least = std::min(least, float((x - i) * (x - i) + (y - j) * (y - j) + (z - k) * (z - k)));
  return least;
}

TEST(SquaredDistances, AreThoseOfTheNearestNode) {
  const std::array<int, 3> size{9, 14, 11};
  for (const int one_of : {2, 10, 300}) {
    unsigned state = 7;
    std::vector<std::uint8_t> set(std::size_t(size[0]) * size[1] * size[2]);
    for (auto& flag : set) {
      state = state * 1664525u + 1013904223u;
      flag = (state >> 8) % unsigned(one_of) == 0;
    }
    const std::vector<float> found = squared_distances(size, set);
    std::size_t at = 0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i, ++at)
          ASSERT_EQ(found[at], nearest(size, set, i, j, k)) << i << ' ' << j << ' ' << k;
  }
}

TEST(SquaredDistances, OfNothingAreInfinite) {
  for (const float d : squared_distances({3, 4, 2}, std::vector<std::uint8_t>(24, 0)))
    EXPECT_GE(d, kInfiniteDistance);
}

}  // namespace
}  // namespace surf::volume
