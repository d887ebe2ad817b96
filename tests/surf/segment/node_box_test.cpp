#include "libsurf/segment/node_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

template <class T>
struct NodeBoxes : ::testing::Test {
  static constexpr int kDim = T::value;
  static NodeBox<kDim> box() {
    NodeBox<kDim> out;
    const std::array<int, 3> size = {9, 14, 11}, lower = {3, -2, 5};
    std::copy_n(size.begin(), kDim, out.size.begin());
    std::copy_n(lower.begin(), kDim, out.lower.begin());
    return out;
  }
  static Flags one_in(unsigned n) {
    unsigned state = 7;
    Flags out(box().n());
    for (auto& flag : out) {
      state = state * 1664525u + 1013904223u;
      flag = (state >> 8) % n == 0;
    }
    return out;
  }
  static int squared(std::size_t a, std::size_t b) {
    int out = 0;
    for (int axis = 0; axis < kDim; ++axis) {
      const int d = box().node(a)[axis] - box().node(b)[axis];
      out += d * d;
    }
    return out;
  }
};
TYPED_TEST_SUITE(NodeBoxes, test::Dims, test::DimName);

TYPED_TEST(NodeBoxes, NumberTheirNodes) {
  const auto box = this->box();
  for (std::size_t at = 0; at < box.n(); ++at) {
    EXPECT_TRUE(box.contains(box.node(at)));
    EXPECT_EQ(box.at(box.node(at)), at);
  }
}

TYPED_TEST(NodeBoxes, KnowTheDistanceOfTheNearestFlagWithinReach) {
  const auto box = this->box();
  for (const unsigned n : {2u, 10u, 150u}) {
    const Flags flags = this->one_in(n);
    for (const int reach : {0, 1, 3, 6}) {
      const auto found = squared_distances(box, flags, reach);
      for (std::size_t at = 0; at < box.n(); ++at) {
        int least = 1000;
        for (std::size_t other = 0; other < box.n(); ++other)
          if (flags[other]) least = std::min(least, this->squared(at, other));
        if (least <= reach * reach)
          ASSERT_EQ(found[at], least);
        else
          ASSERT_GT(found[at], reach * reach);
      }
    }
  }
}

TYPED_TEST(NodeBoxes, KnowTheDistanceOfTheNearestFlagAtAnyDistance) {
  const auto box = this->box();
  for (const unsigned n : {2u, 10u, 150u}) {
    const Flags flags = this->one_in(n);
    const auto found = exact_squared_distances(box, flags);
    for (std::size_t at = 0; at < box.n(); ++at) {
      int least = 1000;
      for (std::size_t other = 0; other < box.n(); ++other)
        if (flags[other]) least = std::min(least, this->squared(at, other));
      if (least < 1000) {
        ASSERT_EQ(found[at], float(least));
      }
    }
  }
  const auto none = exact_squared_distances(box, Flags(box.n(), 0));
  for (const float squared : none) EXPECT_FALSE(std::isfinite(squared));
}

TYPED_TEST(NodeBoxes, BlurKeepsConstantsAndSpreadsOneNodeByOne) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  std::vector<float> same(box.n(), 3);
  blur(box, same);
  for (const float value : same) EXPECT_EQ(value, 3);
  typename NodeBox<Dim>::Index center;
  for (int axis = 0; axis < Dim; ++axis) center[axis] = box.lower[axis] + box.size[axis] / 2;
  std::vector<float> one(box.n());
  one[box.at(center)] = 1;
  blur(box, one);
  double sum = 0, squares = 0;
  for (std::size_t at = 0; at < box.n(); ++at) {
    sum += one[at];
    squares += one[at] * this->squared(at, box.at(center));
  }
  EXPECT_NEAR(sum, 1, 1e-6);
  EXPECT_NEAR(squares, Dim, 1e-5);  // variance 1 along each axis
}

}  // namespace
}  // namespace surf::segment
