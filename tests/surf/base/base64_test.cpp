#include "libsurf/base/base64.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

// RFC 4648, 10.
TEST(Base64, PadsTheLastBytes) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, TakesBytesAsUnsigned) { EXPECT_EQ(base64(std::string("\xff\x00\xfb", 3)), "/wD7"); }

}  // namespace
}  // namespace surf
