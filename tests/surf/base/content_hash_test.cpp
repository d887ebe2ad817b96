#include "libsurf/base/content_hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace surf {
namespace {

// FIPS 180, and echo -n abcdabcd... | sha1sum: what other programs would say of the same bytes.
TEST(ContentHash, IsTheSha1OfTheBytes) {
  EXPECT_EQ(ContentHash().digits(), "da39a3ee5e6b4b0d3255bfef95601890afd80709");
  ContentHash hash;
  hash.add(std::vector<int>{0x64636261, 0x64636261});  // "abcdabcd"
  EXPECT_EQ(hash.digits(), "e0378e12d7ac5f9af37052d8763be4f3e8d13041");
  ContentHash of_bytes;
  of_bytes.add_bytes("abcdabcd");
  EXPECT_EQ(of_bytes.digits(), hash.digits());
}

TEST(ContentHash, GoesOnAfterItWasAsked) {
  ContentHash asked, at_once;
  asked.add(std::vector<float>{1, 2});
  const std::string first = asked.digits();
  EXPECT_EQ(asked.digits(), first);
  asked.add(std::vector<float>{3});
  at_once.add(std::vector<float>{1, 2, 3});
  EXPECT_NE(asked.digits(), first);
  EXPECT_EQ(asked.digits(), at_once.digits());
}

TEST(ContentHash, TellsTheLeastDifferenceApart) {
  const auto of = [](double last) {
    ContentHash hash;
    hash.add(Eigen::Matrix2d{{1, 2}, {3, last}});
    return hash.digits();
  };
  EXPECT_EQ(of(4), of(4));
  EXPECT_NE(of(4), of(std::nextafter(4, 5)));
}

// A block of a larger matrix has gaps between its columns, which do not count.
TEST(ContentHash, OfABlockIsThatOfItsNumbers) {
  const Eigen::MatrixXd all = Eigen::VectorXd::LinSpaced(12, 0, 11).reshaped(4, 3);
  const Eigen::MatrixXd copy = all.block(1, 0, 2, 3);
  ContentHash block, whole;
  block.add(all.block(1, 0, 2, 3));
  whole.add(copy);
  EXPECT_EQ(block.digits(), whole.digits());
}

}  // namespace
}  // namespace surf
