#include "libsurf/base/products.h"

#include <gtest/gtest.h>

#include <numbers>

namespace surf {
namespace {

TEST(Products, AreContentsOfSimplices) {
  EXPECT_EQ(cross({3, 0}, {1, 2}), 6);
  EXPECT_EQ(cross({1, 2}, {3, 0}), -6);
  EXPECT_EQ(triple({1, 0, 0}, {0, 2, 0}, {5, 7, 3}), 6);
}

TEST(Products, AnglesNearZeroAreExact) {
  EXPECT_NEAR(angle_between(Vector<3>(1, 0, 0), Vector<3>(1, 1e-9, 0)), 1e-9, 1e-18);
  EXPECT_NEAR(angle_between(Vector<2>(1, 0), Vector<2>(1, -1e-9)), 1e-9, 1e-18);
  EXPECT_NEAR(angle_between(Vector<3>(1, 0, 0), Vector<3>(-1, 0, 0)), std::numbers::pi, 1e-15);
}

}  // namespace
}  // namespace surf
