#include "libsurf/segment/detail/majority.h"

#include <gtest/gtest.h>

#include <array>

namespace surf::segment {
namespace {

NodeSet<2> row(std::initializer_list<int> columns) {
  NodeBox<2> box;
  box.size = {6, 1};
  NodeSet<2> out(box);
  for (const int column : columns) out.insert({column, 0});
  return out;
}

TEST(Majority, HasWhatMoreThanHalfOfAllWeightHas) {
  const NodeSet<2> a = row({0, 1, 2}), b = row({1, 2, 3}), c = row({2, 3, 4});
  const std::array<const NodeSet<2>*, 3> sets{&a, &b, &c};
  EXPECT_EQ(majority<2>(sets, std::array{1.0, 1.0, 1.0}), row({1, 2, 3}));
  EXPECT_EQ(majority<2>(sets, std::array{3.0, 1.0, 1.0}), a);
  // Half is not more than half.
  EXPECT_EQ(majority<2>(sets, std::array{2.0, 1.0, 1.0}), row({1, 2}));
}

TEST(Majority, OfOneIsThatOne) {
  const NodeSet<2> a = row({0, 5});
  const std::array<const NodeSet<2>*, 1> sets{&a};
  EXPECT_EQ(majority<2>(sets, std::array{0.25}), a);
}

TEST(Majority, IsNotDecidedByWhatDiffersFromAllOthers) {
  const NodeSet<2> near = row({1, 2}), nearer = row({1, 2, 3}), far = row({5});
  const std::array<const NodeSet<2>*, 3> sets{&near, &nearer, &far};
  EXPECT_EQ(majority<2>(sets, std::array{1.0, 0.9, 0.8}), near);
}

}  // namespace
}  // namespace surf::segment
