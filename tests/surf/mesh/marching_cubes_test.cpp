#include "libsurf/mesh/marching_cubes.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "libsurf/mesh/verify.h"

namespace surf::mesh {
namespace {

constexpr int kSize = 7;

int number(int x, int y, int z) { return x + kSize * (y + kSize * z); }

/// The surface round the grid points that are inside, vertices in the middle of the edges.
Triangles surface_of(const std::vector<char>& inside) {
  std::map<std::array<int, 2>, int> vertex_of;
  std::vector<Vector<3>> points;
  std::vector<std::array<int, 3>> elements;
  for (int z = 0; z + 1 < kSize; ++z)
    for (int y = 0; y + 1 < kSize; ++y)
      for (int x = 0; x + 1 < kSize; ++x) {
        int bits = 0;
        for (int c = 0; c < 8; ++c)
          bits |= int(inside[number(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1))]) << c;
        for (const auto& triangle : cube_triangles(bits)) {
          std::array<int, 3> corners;
          for (int i = 0; i < 3; ++i) {
            const CubeEdge edge = cube_edge(triangle[i]);
            const int from = number(x + (edge.corner & 1), y + (edge.corner >> 1 & 1),
                                    z + (edge.corner >> 2 & 1));
            const auto [at, is_new] = vertex_of.insert({{from, edge.axis}, int(points.size())});
            if (is_new) points.push_back(Vector<3>(x, y, z) + edge.middle());
            corners[i] = at->second;
          }
          elements.push_back(corners);
        }
      }
  Triangles out{Points<3>(points.size(), 3), Elements<3>(elements.size(), 3)};
  for (std::size_t i = 0; i < points.size(); ++i) out.points.row(i) = points[i];
  for (std::size_t t = 0; t < elements.size(); ++t)
    for (int i = 0; i < 3; ++i) out.elements(t, i) = elements[t][i];
  return out;
}

TEST(MarchingCubes, AreEmptyWhereNothingIsPartedAndPartWhatIs) {
  EXPECT_TRUE(cube_triangles(0).empty());
  EXPECT_TRUE(cube_triangles(255).empty());
  for (int bits = 1; bits < 255; ++bits) EXPECT_FALSE(cube_triangles(bits).empty()) << bits;
}

TEST(MarchingCubes, OfRandomGridsAreClosedManifoldAndWithoutIntersections) {
  std::mt19937 random(11);
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    std::bernoulli_distribution is_inside(share);
    std::vector<char> inside(kSize * kSize * kSize, 0);
    for (int z = 1; z + 1 < kSize; ++z)
      for (int y = 1; y + 1 < kSize; ++y)
        for (int x = 1; x + 1 < kSize; ++x) inside[number(x, y, z)] = is_inside(random);
    const Verification report = verify(surface_of(inside));
    EXPECT_TRUE(report.closed && report.manifold) << share;
    EXPECT_EQ(report.n_self_intersections, 0) << share;
  }
}

TEST(MarchingCubes, DoNotJoinDiagonalCorners) {
  std::vector<char> inside(kSize * kSize * kSize, 0);
  inside[number(3, 3, 3)] = inside[number(4, 4, 4)] = inside[number(3, 4, 2)] = 1;
  const Triangles surface = surface_of(inside);
  EXPECT_EQ(surface.elements.rows(), 3 * 8);  // three octahedra
}

}  // namespace
}  // namespace surf::mesh
