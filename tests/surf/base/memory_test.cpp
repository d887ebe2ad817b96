#include "libsurf/base/memory.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(Memory, OfTheMachineIsThatOfAComputer) {
  EXPECT_GT(machine_memory(), 64.0 * (1 << 20));
  EXPECT_LT(machine_memory(), 1e15);
}

TEST(Memory, HoldsFourFifthsInFloats) {
  const double floats = machine_memory() / sizeof(float);
  EXPECT_TRUE(fits_in_memory(0));
  EXPECT_TRUE(fits_in_memory(0.79 * floats));
  EXPECT_FALSE(fits_in_memory(0.81 * floats));
}

}  // namespace
}  // namespace surf
