#include "libsurf/segment/contrast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace surf::segment {
namespace {

/// 30 % of 3 and 70 % of 1, with a sum of twelve equally distributed steps as noise.
std::vector<float> two_classes(double noise) {
  std::vector<float> out;
  for (int i = 0; i < 12000; ++i) {
    double sum = -6;
    for (int k = 1; k <= 12; ++k) sum += std::fmod(i * 0.6180339887 * k * k, 1.0);
    out.push_back(float((i % 10 < 3 ? 3 : 1) + noise * sum));
  }
  return out;
}

TEST(TwoClassContrast, IsTheDistanceOfTwoValues) {
  EXPECT_NEAR(two_class_contrast(two_classes(0)), 2, 1e-6);
}

TEST(TwoClassContrast, IsHardlyWidenedByNoise) {
  // Two normal classes four deviations apart overlap by 2 % each.
  EXPECT_NEAR(two_class_contrast(two_classes(0.5)), 2, 0.1);
}

TEST(TwoClassContrast, IsOneOfConstantValues) {
  EXPECT_EQ(two_class_contrast(std::vector<float>(10, 4.0F)), 1);
  EXPECT_EQ(two_class_contrast({}), 1);
}

// By its range alone all others would be in one of the bins.
TEST(TwoClassContrast, IsNotThatOfOneBrokenValue) {
  std::vector<float> values = two_classes(0);
  values.push_back(1e6F);
  EXPECT_NEAR(two_class_contrast(values, {1, 3}), 2, 1e-3);
}

TEST(TwoClassContrast, IsThatOfASmallObjectBeyondWhatIsUsual) {
  std::vector<float> values;
  for (int i = 0; i < 100000; ++i)
    values.push_back(float(i % 2500 == 0 ? 1 : 0.01 * std::sin(i * 0.618)));
  const SeedModel seed{.mean = 1, .radius_mm = 2};
  EXPECT_NEAR(two_class_contrast(values, with_object({-0.1F, 0.1F}, seed)), 1, 0.01);
}

}  // namespace
}  // namespace surf::segment
