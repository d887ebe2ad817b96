#include "libsurf/base/nearest_name.h"

#include <gtest/gtest.h>

#include <vector>

namespace surf {
namespace {

const std::vector<std::string> kNames = {"radius", "edge-length", "sigma",
                                         "seed",   "kidney-ct",   "x"};

TEST(NearestName, ForgivesALetterAddedLeftOutChangedOrSwapped) {
  for (const char* word : {"radiuss", "radus", "radios", "raduis"})
    EXPECT_EQ(nearest_name(word, kNames), "radius") << word;
  EXPECT_EQ(nearest_name("edgelenght", kNames), "edge-length");
  EXPECT_EQ(nearest_name("sed", kNames), "seed");
}

TEST(NearestName, CompletesABeginningOfThreeLettersOrMore) {
  EXPECT_EQ(nearest_name("kidney", kNames), "kidney-ct");
  EXPECT_EQ(nearest_name("ki", kNames), std::nullopt);
}

TEST(NearestName, PrefersAMistypedNameToABeginning) {
  const std::vector<std::string> names = {"selective-sigma", "seel", "seed"};
  EXPECT_EQ(nearest_name("sel", names), "seel");
}

TEST(NearestName, IsNoneWhereAllAreFar) {
  for (const char* word : {"foo", "resample", "y", ""})
    EXPECT_EQ(nearest_name(word, kNames), std::nullopt) << word;
  EXPECT_EQ(did_you_mean("foo", kNames), "");
}

TEST(NearestName, IsAskedForInWords) {
  EXPECT_EQ(did_you_mean("radios", kNames), "; did you mean 'radius'?");
}

}  // namespace
}  // namespace surf
