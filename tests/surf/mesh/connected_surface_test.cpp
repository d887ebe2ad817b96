#include "libsurf/mesh/detail/connected_surface.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "surfaces.h"

namespace surf::mesh {
namespace {

struct Connected : testing::TestWithParam<int> {
  const ConnectedSurface surface{to_mesh(some_surface(GetParam()))};
};

TEST_P(Connected, StarsAreTheTrianglesThatNameAVertex) {
  std::vector<std::vector<int>> expected(surface.n_vertices());
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; i < 3; ++i) expected[surface.vertex(t, i)].push_back(t);
  for (int v = 0; v < surface.n_vertices(); ++v) {
    const auto star = surface.stars[v];
    EXPECT_TRUE(std::ranges::equal(star, expected[v])) << "vertex " << v;
  }
}

TEST_P(Connected, NeighboursRunThroughTheSideTheOtherWay) {
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int from = surface.vertex(t, i), to = surface.vertex(t, (i + 1) % 3);
      const int other = surface.across(t, i);
      bool is_found = false;
      for (int j = 0; j < 3; ++j)
        if (surface.vertex(other, j) == to && surface.vertex(other, (j + 1) % 3) == from)
          is_found = surface.across(other, j) == t;
      EXPECT_TRUE(is_found) << "triangle " << t << ", corner " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(OfSeveralShapes, Connected, testing::Range(0, 4));

}  // namespace
}  // namespace surf::mesh
