#include "libsurf/base/names.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

enum class Fruit { kApple, kPear, kPlum };
constexpr Names<Fruit> kFruits = {
    {Fruit::kPlum, "plum"}, {Fruit::kApple, "apple"}, {Fruit::kPear, "pear"}};

TEST(Names, LeadFromAValueToItsNameAndBack) {
  EXPECT_STREQ(name_of(Fruit::kApple, kFruits), "apple");
  EXPECT_STREQ(name_of(Fruit::kPlum, kFruits), "plum");
  EXPECT_EQ(value_of("pear", kFruits), Fruit::kPear);
  EXPECT_EQ(value_of("Pear", kFruits), std::nullopt);
  EXPECT_EQ(value_of("", kFruits), std::nullopt);
}

TEST(Names, OfTheSameValueAreAllKnownAndTheFirstIsSaid) {
  const Names<Fruit> synonyms = {{Fruit::kPlum, "plum"}, {Fruit::kPlum, "damson"}};
  EXPECT_EQ(value_of("damson", synonyms), Fruit::kPlum);
  EXPECT_STREQ(name_of(Fruit::kPlum, synonyms), "plum");
}

}  // namespace
}  // namespace surf
