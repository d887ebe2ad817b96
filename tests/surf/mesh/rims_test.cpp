#include "libsurf/mesh/detail/rims.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr int kAround = 24, kAcross = 10;

/// A torus whose rings a to b (not included) are chosen; ring i has the vertices i * kAcross + j.
struct TorusWithRings {
  const ConnectedSurface surface{to_mesh(torus(1, 0.4, kAround, kAcross))};
  TriangleFlags is_chosen = TriangleFlags(surface.n_triangles(), 0);

  void choose(int a, int b) {
    for (int t = 0; t < surface.n_triangles(); ++t) {
      // The three corners lie on two neighbouring rings.
      std::set<int> on;
      for (int i = 0; i < 3; ++i) on.insert(surface.vertex(t, i) / kAcross);
      for (int ring = a; ring < b; ++ring)
        if (on == std::set<int>{ring, ring + 1}) is_chosen[t] = 1;
    }
  }
};

TEST(Rims, OfATubeAreItsTwoEndRings) {
  TorusWithRings t;
  t.choose(3, 8);
  const auto found = rims(free_sides(t.surface, t.is_chosen));
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 2u);
  for (const int end : {0, 1}) {
    const Rim& rim = (*found)[end];
    EXPECT_EQ(rim.size(), std::size_t(kAcross));
    for (const int v : rim) EXPECT_EQ(v / kAcross, end == 0 ? 3 : 8);
  }
}

TEST(Rims, RunAsTheTrianglesDo) {
  TorusWithRings t;
  t.choose(3, 8);
  std::set<Side> sides;
  for (int f = 0; f < t.surface.n_triangles(); ++f)
    for (int i = 0; t.is_chosen[f] && i < 3; ++i)
      sides.emplace(t.surface.vertex(f, i), t.surface.vertex(f, (i + 1) % 3));
  const auto found = rims(free_sides(t.surface, t.is_chosen));
  ASSERT_TRUE(found);
  for (const Rim& rim : *found)
    for (std::size_t i = 0; i < rim.size(); ++i) {
      EXPECT_TRUE(sides.contains({rim[i], rim[(i + 1) % rim.size()]}));
      EXPECT_FALSE(sides.contains({rim[(i + 1) % rim.size()], rim[i]}));
    }
}

TEST(Rims, AreTheSameForTrianglesOfASoup) {
  TorusWithRings t;
  t.choose(2, 5);
  t.choose(9, 11);
  std::vector<std::array<int, 3>> soup;
  for (int f = 0; f < t.surface.n_triangles(); ++f)
    if (t.is_chosen[f])
      soup.push_back({t.surface.vertex(f, 0), t.surface.vertex(f, 1), t.surface.vertex(f, 2)});
  const auto of_soup = rims(free_sides(soup)),
             of_surface = rims(free_sides(t.surface, t.is_chosen));
  ASSERT_TRUE(of_soup && of_surface);
  EXPECT_EQ(*of_soup, *of_surface);
  EXPECT_EQ(of_soup->size(), 4u);
}

TEST(Rims, AreNoneOfAClosedSurface) {
  TorusWithRings t;
  std::fill(t.is_chosen.begin(), t.is_chosen.end(), 1);
  const auto found = rims(free_sides(t.surface, t.is_chosen));
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->empty());
}

TEST(Rims, AreNotFoundWhereTrianglesTouchInAVertex) {
  const std::vector<std::array<int, 3>> bow = {{0, 1, 2}, {0, 3, 4}};
  const std::vector<Side> sides = free_sides(bow);
  EXPECT_EQ(sides.size(), 6u);
  EXPECT_EQ(crowded_vertices(sides), std::vector<int>{0});
  EXPECT_FALSE(rims(sides));
  EXPECT_TRUE(crowded_vertices(free_sides({{0, 1, 2}, {5, 3, 4}})).empty());
}

TEST(Rims, AreNotFoundWhereAPolygonDoesNotClose) {
  const std::vector<Side> sides = {{0, 1}, {1, 2}};
  EXPECT_TRUE(crowded_vertices(sides).empty());
  EXPECT_FALSE(rims(sides));
}

}  // namespace
}  // namespace surf::mesh
