#include "libsurf/segment/rung_features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace surf::segment {
namespace {

TEST(RungFeatures, ScoreAsTheFormulaSays) {
  RungFeatures rung;
  rung.separation = 0.9;
  rung.edge_share = 0.8;
  rung.sphericity = 0.49;
  rung.growth_in = 0.2;
  rung.growth_out = 1.1;
  EXPECT_DOUBLE_EQ(rung.score(), 0.9 * 0.8 * 0.7 * 1.1 * std::exp(-0.05));
}

TEST(HistogramSeparation, IsOneOfWhatDoesNotOverlapAndZeroOfTheSame) {
  std::vector<float> low, high, mixed;
  for (int i = 0; i < 1000; ++i) {
    low.push_back(float(i) / 1000);
    high.push_back(5 + float(i) / 1000);
    mixed.push_back(i % 2 ? low.back() : high.back());
  }
  EXPECT_NEAR(histogram_separation(low, high), 1, 1e-12);
  EXPECT_NEAR(histogram_separation(low, low), 0, 1e-12);
  EXPECT_NEAR(histogram_separation(low, mixed), 0.5, 0.01);
}

TEST(HistogramSeparation, IsZeroWhereThereIsNothingToCompare) {
  EXPECT_EQ(histogram_separation(std::vector<float>(9, 3.f), std::vector<float>(5, 3.f)), 0);
  EXPECT_EQ(histogram_separation({}, std::vector<float>(5, 3.f)), 0);
}

}  // namespace
}  // namespace surf::segment
