#include "tests/bench/topology_fuzz.h"

#include <gtest/gtest.h>

namespace surf::mesh::fuzz {
namespace {

// tests/bench/topology_fuzz runs hundreds of these.
TEST(TopologyFuzz, RandomEvolutionsStayValidAndEndAtTheLevelSetThatMovedWithThem) {
  openvdb::initialize();
  constexpr double kLargestDifference = 0.3;  // of area times resolution; 0.22 measured
  int n_compared = 0, n_with_events = 0;
  for (const int seed : {2, 6, 11}) {  // that do not vanish
    const Outcome outcome = run(seed, Topology::kFree);
    EXPECT_TRUE(outcome.is_valid) << "run " << seed;
    EXPECT_LT(outcome.difference, kLargestDifference) << "run " << seed;
    n_compared += outcome.difference > 0;
    n_with_events += outcome.n_events > 0;
  }
  EXPECT_EQ(n_compared, 3);
  EXPECT_GE(n_with_events, 1);
}

TEST(TopologyFuzz, RandomEvolutionsKeepTheTopologyTheyArePromised) {
  openvdb::initialize();
  for (const Topology topology : {Topology::kFixed, Topology::kGenus0})
    for (int seed = 0; seed < 6; ++seed) {
      const Outcome outcome = run(seed, topology);
      EXPECT_TRUE(outcome.is_valid) << "run " << seed;
      EXPECT_TRUE(outcome.keeps_promise) << "run " << seed;
    }
}

}  // namespace
}  // namespace surf::mesh::fuzz
