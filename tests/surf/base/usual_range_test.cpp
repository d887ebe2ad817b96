#include "libsurf/base/usual_range.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace surf {
namespace {

using Range = std::array<float, 2>;

std::vector<float> noise(std::size_t n) {
  std::mt19937 random(1);
  std::normal_distribution<float> value(100, 10);
  std::vector<float> out(n);
  for (float& at : out) at = value(random);
  return out;
}

TEST(UsualRange, IsTheWholeOneOfValuesWithoutAnyFarAway) {
  const std::vector<float> values = noise(10000);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  EXPECT_EQ(usual_range({*low, *high}, values), (Range{*low, *high}));
}

TEST(UsualRange, EndsFourRangesBeyondNearlyAllValues) {
  std::vector<float> values = noise(100000);
  values[7] = 1e6f;
  const Range range = usual_range({50, 1e6f}, values);
  EXPECT_EQ(range[0], 50);
  EXPECT_NEAR(range[1], 131 + 4 * 62, 10);  // 0.999 of a normal distribution is 3.09 deviations
  for (float& value : values) value = 3 * value - 1000;
  const Range scaled = usual_range({3 * 50 - 1000, 3e6f}, values);
  EXPECT_NEAR(scaled[1], 3 * range[1] - 1000, 1);
}

TEST(UsualRange, IsTheWholeOneOfASmallObjectBeforeNothing) {
  std::vector<float> values(10000, 0.f);
  values[7] = 5;
  EXPECT_EQ(usual_range({0, 5}, values), (Range{0, 5}));
  EXPECT_EQ(usual_range({2, 2}, {2.f}), (Range{2, 2}));
}

}  // namespace
}  // namespace surf
