#include "libsurf/base/option_checks.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(OptionChecks, TellTheFirstThatDoesNotHold) {
  OptionChecks checks("Options");
  checks.require(true, "a", 1, "> 0");
  EXPECT_EQ(checks.error(), "");
  checks.require(false, "b", -2.5, ">= 0");
  checks.require(false, "c", 7, "< 1");
  EXPECT_EQ(checks.error(), "Options::b = -2.5 violates >= 0");
}

}  // namespace
}  // namespace surf
