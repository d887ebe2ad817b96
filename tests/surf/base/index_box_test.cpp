#include "libsurf/base/index_box.h"

#include <gtest/gtest.h>

#include <vector>

namespace surf {
namespace {

const IndexBox<3> kBox = IndexBox<3>::between({-1, 2, 5}, {3, 4, 8});

TEST(IndexBox, NumbersWhatIsInItWithTheFirstIndexFastest) {
  EXPECT_EQ(kBox.n(), 4u * 2 * 3);
  EXPECT_EQ(kBox.upper(), (std::array{3, 4, 8}));
  std::size_t at = 0;
  for (int k = 5; k < 8; ++k)
    for (int j = 2; j < 4; ++j)
      for (int i = -1; i < 3; ++i, ++at) {
        EXPECT_EQ(kBox.at({i, j, k}), at);
        EXPECT_EQ(kBox.node(at), (std::array{i, j, k}));
      }
  EXPECT_EQ(kBox.at({0, 3, 6}), 1 + kBox.stride(1) + kBox.stride(2));
}

TEST(IndexBox, ContainsItsLowerNodesButNotItsUpper) {
  EXPECT_TRUE(kBox.contains({-1, 2, 5}));
  EXPECT_TRUE(kBox.contains({2, 3, 7}));
  EXPECT_FALSE(kBox.contains({3, 3, 7}));
  EXPECT_FALSE(kBox.contains({2, 1, 7}));
}

TEST(IndexBox, NeighboursAreThoseAlongTheAxesThatTheBoxDoesNotCutOff) {
  std::vector<std::array<int, 3>> found;
  const auto collect = [&](std::size_t at) { found.push_back(kBox.node(at)); };
  EXPECT_EQ(kBox.for_neighbours(kBox.at({1, 2, 6}), collect), 1);
  EXPECT_EQ(found, (std::vector<std::array<int, 3>>{
                       {0, 2, 6}, {2, 2, 6}, {1, 3, 6}, {1, 2, 5}, {1, 2, 7}}));
}

TEST(IndexBox, OfThePlaneHasFourNeighboursInside) {
  const IndexBox<2> box{{0, 0}, {3, 3}};
  std::size_t sum = 0;
  EXPECT_EQ(box.for_neighbours(4, [&](std::size_t at) { sum += at; }), 0);
  EXPECT_EQ(sum, 1u + 3 + 5 + 7);
}

}  // namespace
}  // namespace surf
