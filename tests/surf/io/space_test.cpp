#include "libsurf/io/space.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"

namespace surf::io {
namespace {

TEST(Space, IsStatedAnywhereInAHeader) {
  EXPECT_EQ(stated_space("a surface; SPACE=LPS; mm", "f"), Space::kLps);
  EXPECT_EQ(stated_space("SPACE=RAS", "f"), Space::kRas);
  EXPECT_EQ(stated_space("", "f"), std::nullopt);
  EXPECT_EQ(stated_space("white space", "f"), std::nullopt);
}

TEST(Space, OfAnotherWordIsRefusedByName) {
  try {
    stated_space("SPACE=LAS", "head.stl");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("head.stl"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("LAS"), std::string::npos);
  }
}

TEST(Space, FlipsTwoAxesAndBackExactly) {
  Points<3> points(2, 3);
  points << 0.1, -2, 3, 1e-300, 7, -0.3;
  const Points<3> lps = converted(points, Space::kLps);
  EXPECT_EQ(lps.row(0), Eigen::RowVector3d(-0.1, 2, 3));
  EXPECT_EQ(converted(lps, Space::kLps), points);
  EXPECT_EQ(converted(points, Space::kRas), points);
  EXPECT_EQ(name(Space::kLps), "LPS");
}

}  // namespace
}  // namespace surf::io
