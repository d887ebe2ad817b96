#include "libsurf/base/disjoint_sets.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(DisjointSets, GrowTogether) {
  DisjointSets sets(5);
  sets.join(0, 3);
  sets.join(4, 3);
  EXPECT_EQ(sets.find(0), sets.find(4));
  EXPECT_NE(sets.find(0), sets.find(1));
  EXPECT_NE(sets.find(1), sets.find(2));
}

TEST(DisjointSets, AreNamedByTheirSmallestNumber) {
  DisjointSets sets(5);
  sets.join(4, 2);
  sets.join(2, 1);
  EXPECT_EQ(sets.find(4), 1);
}

}  // namespace
}  // namespace surf
