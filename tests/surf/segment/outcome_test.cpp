#include "libsurf/segment/outcome.h"

#include <gtest/gtest.h>

namespace surf::segment {
namespace {

TEST(Outcome, HasAWordAndACodeOfItsOwn) {
  EXPECT_EQ(to_string(Outcome::kProposed), "proposed");
  EXPECT_EQ(exit_code(Outcome::kConverged), 0);
  EXPECT_EQ(exit_code(Outcome::kAtLimit), 5);
  EXPECT_EQ(exit_code(Outcome::kNoObject), 8);
  EXPECT_EQ(exit_code(Outcome::kVanished), 8);
  EXPECT_EQ(exit_code(Outcome::kStopped), 130);
}

TEST(Outcome, OfAFlowIsThatOfItsEnd) {
  EXPECT_EQ(outcome_of(flow::Termination::kConverged), Outcome::kConverged);
  EXPECT_EQ(outcome_of(flow::Termination::kStalled), Outcome::kConverged);
  EXPECT_EQ(outcome_of(flow::Termination::kMaxSteps), Outcome::kAtLimit);
  EXPECT_EQ(outcome_of(flow::Termination::kStopped), Outcome::kStopped);
}

TEST(Outcome, SaysWhetherThereIsAShape) {
  EXPECT_TRUE(has_shape(Outcome::kAtLimit));
  EXPECT_TRUE(has_shape(Outcome::kStopped));
  EXPECT_FALSE(has_shape(Outcome::kNoObject));
  EXPECT_FALSE(has_shape(Outcome::kVanished));
}

}  // namespace
}  // namespace surf::segment
