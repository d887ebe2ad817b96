#include "libsurf/mesh/distance_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surf::mesh {
namespace {

TEST(DistanceStatistics, TakeMeansOfMagnitudesAndTheBiasOfTheSigns) {
  const DistanceStatistics found = distance_statistics({1, -3, 2, -4}, {-0.5});
  EXPECT_EQ(found.mean_mm, 2.5);
  EXPECT_EQ(found.signed_mean_mm, -1);
  EXPECT_EQ(found.rms_mm, std::sqrt(7.5));
  EXPECT_EQ(found.max_mm, 4);
}

TEST(DistanceStatistics, FindTheLargestAmongVerticesToo) {
  EXPECT_EQ(distance_statistics({1, 2}, {-7}).max_mm, 7);
}

TEST(DistanceStatistics, HaveNineteenOfTwentySamplesBelowTheP95) {
  std::vector<double> values;
  for (int i = 0; i <= 100; ++i) values.push_back(i % 2 ? i : -i);
  EXPECT_EQ(distance_statistics(values, {}).p95_mm, 95);
}

TEST(DistanceStatistics, OfBothDirectionsAreWeightedBySizeAndTheLargerOfBoth) {
  DistanceStatistics forward, backward;
  forward.mean_mm = 1, forward.rms_mm = 2, forward.p95_mm = 5, forward.max_mm = 6;
  backward.mean_mm = 4, backward.rms_mm = 5, backward.p95_mm = 3, backward.max_mm = 9;
  const SymmetricDistances both = symmetric_distances(forward, 1, backward, 2);
  EXPECT_EQ(both.mean_mm, 3);
  EXPECT_EQ(both.rms_mm, std::sqrt(18.0));
  EXPECT_EQ(both.p95_mm, 5);
  EXPECT_EQ(both.max_mm, 9);
  EXPECT_EQ(both.backward.mean_mm, 4);
}

}  // namespace
}  // namespace surf::mesh
