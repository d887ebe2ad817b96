#include "libsurf/base/escaped.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(Escaped, ReplacesEachOfTheCharactersOnce) {
  EXPECT_EQ(escaped("a<b & <c", {{'&', "&amp;"}, {'<', "&lt;"}}), "a&lt;b &amp; &lt;c");
  EXPECT_EQ(escaped("a\\n\n", {{'\\', "\\\\"}, {'\n', "\\n"}}), "a\\\\n\\n");
  EXPECT_EQ(escaped("", {{'x', "y"}}), "");
}

}  // namespace
}  // namespace surf
