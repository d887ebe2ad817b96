#include "libsurf/base/arrays.h"

#include <gtest/gtest.h>

namespace surf {
namespace {

TEST(Arrays, HoldOneOfAListARow) {
  const Points<3> points = points_of<3>({{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(points, (Points<3>(2, 3) << 1, 2, 3, 4, 5, 6).finished());
  const Elements<2> elements = elements_of(std::vector<std::array<int, 2>>{{0, 1}, {1, 2}});
  EXPECT_EQ(elements, (Elements<2>(2, 2) << 0, 1, 1, 2).finished());
}

TEST(Arrays, OfAllPartsNumberTheirPointsOneAfterTheOther) {
  Segments part{Points<2>(2, 2), Elements<2>(2, 2)};
  part.points << 0, 0, 1, 0;
  part.elements << 0, 1, 1, 0;
  const Segments all = all_of<Segments>(std::vector<Segments>(2, part));
  EXPECT_EQ(all.points.rows(), 4);
  EXPECT_EQ(all.elements, (Elements<2>(4, 2) << 0, 1, 1, 0, 2, 3, 3, 2).finished());
  EXPECT_EQ(all_of<Triangles>({}).elements.rows(), 0);
}

}  // namespace
}  // namespace surf
