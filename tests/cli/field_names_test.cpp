#include "tools/common/field_names.h"

#include <gtest/gtest.h>

namespace surfseg {
namespace {

TEST(FieldNames, AreOptionsOnTheCommandLine) {
  EXPECT_EQ(with_option_names("Options::coarseness = 0 violates >= 1", "surfseg"),
            "--coarseness = 0 violates >= 1");
  EXPECT_EQ(with_option_names("file.dcm: give Options::seeds_mm[12], or FlowOptions::step.rule.",
                              "surfseg"),
            "file.dcm: give --seed, or --step-rule.");
}

TEST(FieldNames, OfTheContentDependOnTheProgram) {
  const std::string message = "FlowOptions::content = -1 violates > 0";
  EXPECT_EQ(with_option_names(message, "surfseg"), "--volume = -1 violates > 0");
  EXPECT_EQ(with_option_names(message, "curveseg"), "--area = -1 violates > 0");
}

TEST(FieldNames, WithoutAnOptionStayAsTheyAre) {
  for (const char* message :
       {"DenoisedOptions::block = 0 violates >= 1", "a::b", "::", "plain text", "x: Options::"})
    EXPECT_EQ(with_option_names(message, "surfseg"), message);
}

TEST(FieldNames, OfSeedsElsewhereAskForTheSpace) {
  EXPECT_EQ(with_option_names("Options::seeds_mm: (1, 2) is outside; is it in another space?",
                              "curveseg"),
            "--seed: (1, 2) is outside; is it in another space (--space)?");
}

}  // namespace
}  // namespace surfseg
