#include "tests/bench/topology_fuzz.h"

#include <gtest/gtest.h>

namespace surf::mesh::fuzz {
namespace {

// tests/bench/topology_fuzz runs hundreds of these.
TEST(TopologyFuzz, RandomEvolutionsStayValidAndEndAtTheLevelSetThatMovedWithThem) {
  openvdb::initialize();
  constexpr double kLargestDifference = 0.3;  // of area times resolution; 0.13 and 0.22
  for (const int seed : {2, 6}) {             // they merge and split, and do not vanish
    const Outcome outcome = run(seed, Topology::kFree);
    EXPECT_TRUE(outcome.is_valid) << "run " << seed;
    EXPECT_LT(outcome.difference, kLargestDifference) << "run " << seed;
    EXPECT_FALSE(outcome.has_vanished) << "run " << seed;
    EXPECT_GE(outcome.n_events, 2) << "run " << seed;
  }
}

TEST(TopologyFuzz, RandomEvolutionsKeepTheTopologyTheyArePromised) {
  openvdb::initialize();
  for (const Topology topology : {Topology::kFixed, Topology::kGenus0})
    for (int seed = 0; seed < 4; ++seed) {
      const Outcome outcome = run(seed, topology);
      EXPECT_TRUE(outcome.is_valid) << "run " << seed;
      EXPECT_TRUE(outcome.keeps_promise) << "run " << seed;
    }
}

}  // namespace
}  // namespace surf::mesh::fuzz
