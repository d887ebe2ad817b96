#include "libsurf/mesh/detail/edge_uses.h"

#include <gtest/gtest.h>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

TEST(EdgeUses, OfAClosedSurfaceAreOnePairInOppositeDirectionsAnEdge) {
  const Triangles surface = some_surface(0);
  const auto uses = edge_uses(surface.elements);
  EXPECT_EQ(Eigen::Index(uses.size()), 3 * surface.elements.rows());
  Eigen::Index n_edges = 0;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    ++n_edges;
    ASSERT_EQ(edge.size(), 2u);
    EXPECT_NE(edge[0].is_forward, edge[1].is_forward);
    for (const EdgeUse& use : edge) {
      const int from = surface.elements(use.element, use.corner);
      const int to = surface.elements(use.element, (use.corner + 1) % 3);
      EXPECT_EQ(std::min(from, to), use.low);
      EXPECT_EQ(std::max(from, to), use.high);
      EXPECT_EQ(use.is_forward, from < to);
    }
  });
  EXPECT_EQ(surface.points.rows() - n_edges + surface.elements.rows(), 2);  // Euler
}

TEST(EdgeUses, CountTheTrianglesOfAnEdgeThatThreeShare) {
  Elements<3> fan(3, 3);
  fan << 0, 1, 2, 0, 1, 3, 1, 0, 4;
  std::vector<std::size_t> sizes;
  for_each_edge(edge_uses(fan),
                [&](std::span<const EdgeUse> edge) { sizes.push_back(edge.size()); });
  EXPECT_EQ(sizes, (std::vector<std::size_t>{3, 1, 1, 1, 1, 1, 1}));
}

TEST(EdgeUses, JoinTrianglesToComponentsByEdgesNotByPoints) {
  Elements<3> elements(4, 3);
  elements << 5, 6, 7, 0, 1, 2, 2, 1, 3, 3, 8, 9;  // the last two share a point only
  const Components found = components(edge_uses(elements), elements.rows());
  EXPECT_EQ(found.n, 3);
  EXPECT_EQ(found.of_element, (std::vector<int>{0, 1, 1, 2}));
}

}  // namespace
}  // namespace surf::mesh
