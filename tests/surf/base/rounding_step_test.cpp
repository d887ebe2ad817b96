#include "libsurf/base/rounding_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace surf {
namespace {

constexpr std::size_t kRow = 64;

/// Rows across a blob whose edge is so wide.
std::vector<float> rows_of(double width) {
  std::vector<float> out;
  for (int row = 0; row < 16; ++row)
    for (int i = 0; i < int(kRow); ++i)
      out.push_back(
          float(40 + 160 / (1 + std::exp((std::abs(i - 32.3) - 15 + row / 4.0) / width))));
  return out;
}

TEST(RoundingStep, OfSlopesIsWhatTheyWereRoundedTo) {
  std::vector<float> values = rows_of(2);
  EXPECT_LT(rounding_step(values, kRow), 1e-3);
  for (float& value : values) value = std::round(value);
  EXPECT_EQ(rounding_step(values, kRow), 1);
}

TEST(RoundingStep, ScalesWithTheValues) {
  for (const float scale : {0.5f, 10.f, 200.f, 0.1f}) {
    std::vector<float> values = rows_of(2);
    for (float& value : values) value = scale * std::round(value) - 3;
    EXPECT_NEAR(rounding_step(values, kRow), scale, 1e-3 * scale);
  }
}

TEST(RoundingStep, IsNoneWhereItMayBeAnEdge) {
  std::vector<float> labels;
  for (int i = 0; i < int(16 * kRow); ++i) {
    const int at = i % int(kRow);
    labels.push_back(at < 20 ? 3.f : at < 40 ? 4.f : at < 60 ? 11.f : 12.f);
  }
  EXPECT_EQ(rounding_step(labels, kRow), 0);
  EXPECT_EQ(rounding_step(std::vector<float>(256, 5.f), kRow), 0);
  EXPECT_EQ(rounding_step({}, kRow), 0);
}

TEST(RoundingStep, OfNoiseInFloatsIsNothing) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::vector<float> values(16 * kRow);
  for (float& value : values) value = 100 + 5 * normal(random);
  EXPECT_LT(rounding_step(values, kRow), 1e-4);
}

}  // namespace
}  // namespace surf
