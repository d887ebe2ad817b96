#include "libsurf/base/memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace surf {
namespace {

TEST(Memory, OfTheMachineIsThatOfAComputer) {
  EXPECT_GT(machine_memory(), 64.0 * (1 << 20));
  EXPECT_LT(machine_memory(), 1e15);
}

TEST(Memory, HoldsFourFifths) {
  EXPECT_TRUE(fits_in_memory(0));
  EXPECT_TRUE(fits_in_memory(0.79 * machine_memory()));
  EXPECT_FALSE(fits_in_memory(0.81 * machine_memory()));
}

TEST(Memory, ThatMayBeUsedIsNoMoreThanTheProcessIsAllowed) {
  EXPECT_LE(usable_memory(), machine_memory());
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_DATA, &before), 0);
  rlimit small = before;
  small.rlim_cur = rlim_t(3) << 30;
  ASSERT_EQ(::setrlimit(RLIMIT_DATA, &small), 0);
  const double usable = usable_memory();
  const std::string text = usable_memory_text();
  ::setrlimit(RLIMIT_DATA, &before);
  if (machine_memory() < 3.1 * (1 << 30)) GTEST_SKIP() << "a machine of less than that";
  EXPECT_EQ(usable, 3.0 * (1 << 30));
  EXPECT_EQ(text, "3.0 GiB are allowed");
}

TEST(Memory, WhatAFileDeclaresIsBorneOutByAThousandthOfItsBytes) {
  EXPECT_TRUE(is_borne_out(4 << 20, 0));
  EXPECT_TRUE(is_borne_out(1e9, 1e6));
  EXPECT_FALSE(is_borne_out(2e9, 1e6));
}

}  // namespace
}  // namespace surf
