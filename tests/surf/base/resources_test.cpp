#include "libsurf/base/resources.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>
#include <vector>

namespace surf {
namespace {

TEST(Resources, CountWaitingAsWallTimeOnly) {
  const ResourceMeter meter;
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Resources used = meter.used();
  EXPECT_GE(used.seconds, 0.05);
  EXPECT_LT(used.cpu_seconds, used.seconds);
}

TEST(Resources, CountWorkAsCpuTime) {
  const ResourceMeter meter;
  volatile double sum = 0;
  for (int i = 1; meter.used().cpu_seconds < 0.02; ++i) sum = sum + std::sqrt(double(i));
  EXPECT_GE(meter.used().cpu_seconds, 0.02);
  EXPECT_GT(sum, 0);
}

TEST(Resources, KnowTheLargestMemory) {
  const double before = ResourceMeter().used().peak_memory_mb;
  const auto n = std::size_t((before + 64) * (1 << 20));
  const std::vector<char> block(n, 1);  // touched
  EXPECT_EQ(block.back(), 1);
  EXPECT_GE(ResourceMeter().used().peak_memory_mb, before + 32);
}

}  // namespace
}  // namespace surf
