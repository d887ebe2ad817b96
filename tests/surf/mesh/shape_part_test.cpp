#include "libsurf/mesh/shape_part.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libsurf/mesh/primitives.h"

namespace surf::mesh {
namespace {

/// Flags of the triangles that have no vertex above the plane z = 0.
std::vector<char> lower_half(const Triangles& surface) {
  std::vector<char> out;
  for (const auto& t : surface.elements.rowwise())
    out.push_back(
        std::none_of(t.begin(), t.end(), [&](int i) { return surface.points(i, 2) > 0; }));
  return out;
}

TEST(ShapePart, HasTheElementsThatAreNotLeftOut) {
  const Triangles whole = ball({0, 0, 0}, 2, 0.4);
  const std::vector<char> is_left_out = lower_half(whole);
  const ShapePart<3> part = part_of<3>(whole, is_left_out);
  EXPECT_EQ(Eigen::Index(part.elements.size()),
            std::count(is_left_out.begin(), is_left_out.end(), 0));
  for (std::size_t t = 0; t < part.elements.size(); ++t)
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(part.shape.points.row(part.shape.elements(Eigen::Index(t), i)),
                whole.points.row(whole.elements(part.elements[t], i)));
  // Whoever is above has all its triangles in the part.
  for (std::size_t k = 0; k < part.vertices.size(); ++k)
    if (whole.points(part.vertices[k], 2) > 0) {
      EXPECT_FALSE(part.is_shared[k]);
    }
  EXPECT_GT(std::count(part.is_shared.begin(), part.is_shared.end(), 1), 0);
}

TEST(ShapePart, IsTheWholeWhereNothingIsLeftOut) {
  const Triangles whole = ball({0, 0, 0}, 2, 0.4);
  const ShapePart<3> part = part_of<3>(whole, {});
  EXPECT_EQ(part.shape.points, whole.points);
  EXPECT_EQ(part.shape.elements, whole.elements);
}

TEST(ShapePart, GrowsByARing) {
  const Triangles whole = ball({0, 0, 0}, 2, 0.4);
  const ShapePart<3> part = part_of<3>(whole, lower_half(whole));
  const std::vector<char> grown = without_neighbours<3>(whole.elements, lower_half(whole));
  const ShapePart<3> larger = part_of<3>(whole, grown);
  EXPECT_GT(larger.elements.size(), part.elements.size());
  // What was shared has all its triangles now.
  for (std::size_t k = 0; k < part.vertices.size(); ++k) {
    const auto at = std::find(larger.vertices.begin(), larger.vertices.end(), part.vertices[k]);
    ASSERT_NE(at, larger.vertices.end());
    EXPECT_FALSE(larger.is_shared[std::size_t(at - larger.vertices.begin())]);
  }
}

}  // namespace
}  // namespace surf::mesh
