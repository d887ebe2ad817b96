#include "libsurf/base/threads.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace surf {
namespace {

std::size_t allowed() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

TEST(ThreadLimit, HoldsWhileItLivesAndTheSmallestCounts) {
  const std::size_t before = allowed();
  {
    const ThreadLimit two(2);
    EXPECT_EQ(allowed(), 2u);
    {
      const ThreadLimit one(1);
      EXPECT_EQ(allowed(), 1u);
    }
    EXPECT_EQ(allowed(), 2u);
  }
  EXPECT_EQ(allowed(), before);
}

}  // namespace
}  // namespace surf
