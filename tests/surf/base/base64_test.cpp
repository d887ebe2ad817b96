#include "libsurf/base/base64.h"

#include <gtest/gtest.h>

#include <utility>

namespace surf {
namespace {

// RFC 4648, 10.
TEST(Base64, PadsTheLastBytes) {
  constexpr std::pair<const char*, const char*> kVectors[] = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : kVectors) EXPECT_EQ(base64(bytes), text);
}

TEST(Base64, TakesBytesAsUnsigned) { EXPECT_EQ(base64(std::string("\xff\x00\xfb", 3)), "/wD7"); }

}  // namespace
}  // namespace surf
