#include "libsurf/base/escaped.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(Escaped, ReplacesEachOfTheCharactersOnce) {
  EXPECT_EQ(escaped("a<b & <c", {{'&', "&amp;"}, {'<', "&lt;"}}), "a&lt;b &amp; &lt;c");
  EXPECT_EQ(escaped("a\\n\n", {{'\\', "\\\\"}, {'\n', "\\n"}}), "a\\\\n\\n");
  EXPECT_EQ(escaped("", {{'x', "y"}}), "");
}

TEST(Escaped, OneLineKeepsAllButControlCharacters) {
  EXPECT_EQ(one_line("a\nb\tc\x1b[0m \x7f\u00e9'"), "a?b?c?[0m ?\u00e9'");
}

}  // namespace
}  // namespace surf
