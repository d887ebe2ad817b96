#include "tests/bench/curve_fuzz.h"

#include <gtest/gtest.h>

namespace surf::curve::fuzz {
namespace {

// tests/bench/curve_fuzz runs thousands of these.
TEST(CurveFuzz, RandomEvolutionsStayValidAndEndAtTheUnionOfWhatMoved) {
  // Of length times resolution; what is joined or cut is thinner than the resolution.
  constexpr double kLargestDifference = 1;
  int n_compared = 0;
  for (int seed = 0; seed < 60; ++seed) {
    const Outcome outcome = Evolution(seed).run();
    EXPECT_TRUE(outcome.is_valid) << "run " << seed << ": " << outcome.message;
    EXPECT_LT(outcome.difference, kLargestDifference) << "run " << seed;
    n_compared += outcome.is_compared;
  }
  EXPECT_GT(n_compared, 15);
}

}  // namespace
}  // namespace surf::curve::fuzz
