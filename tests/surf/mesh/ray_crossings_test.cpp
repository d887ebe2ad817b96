#include "libsurf/mesh/detail/ray_crossings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;

std::vector<int> windings(const Triangles& surface, const Points<3>& origins) {
  std::vector<int> result(origins.rows());
  for (const RayCrossing& crossing : ray_crossings(surface, origins))
    result[crossing.ray] += crossing.sign;
  return result;
}

TEST(RayCrossings, SumToTheWindingNumberOfRandomPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  Points<3> origins(2000, 3);
  for (double& x : origins.reshaped()) x = uniform(random);
  const Triangles balls =  // windings 1, 2, -1, 0
      joined(joined(sphere({0, 0, 0}, 1, 4), sphere({0.1, 0.2, 0}, 0.5, 3)),
             flipped(sphere({1.4, 0, 0}, 0.6, 3)));
  const std::vector<int> found = windings(balls, origins);
  int n_checked = 0;
  for (Eigen::Index n = 0; n < origins.rows(); ++n) {
    const Vector<3> p = origins.row(n);
    const double depth[3] = {1 - p.norm(), 0.5 - (p - Vector<3>(0.1, 0.2, 0)).norm(),
                             0.6 - (p - Vector<3>(1.4, 0, 0)).norm()};
    constexpr double kChords = 0.03;  // the inscribed polyhedra lie this little inside the balls
    if (std::abs(depth[0]) < kChords || std::abs(depth[1]) < kChords ||
        std::abs(depth[2]) < kChords)
      continue;
    EXPECT_EQ(found[n], (depth[0] > 0) + (depth[1] > 0) - (depth[2] > 0)) << p.transpose();
    ++n_checked;
  }
  EXPECT_GT(n_checked, 1500);
}

// Integer coordinates: the rays run through vertices, along edges and in faces.
TEST(RayCrossings, DecideRaysThroughVerticesAndEdges) {
  const Triangles octahedron = sphere({0, 0, 0}, 4, 0);
  Points<3> origins(13 * 13 * 13, 3);
  for (int n = 0; n < 13 * 13 * 13; ++n) origins.row(n) << n % 13 - 6, n / 13 % 13 - 6, n / 169 - 6;
  const std::vector<int> found = windings(octahedron, origins);
  for (Eigen::Index n = 0; n < origins.rows(); ++n) {
    const double sum = origins.row(n).cwiseAbs().sum();
    if (sum == 4) continue;  // on the surface
    EXPECT_EQ(found[n], sum < 4) << origins.row(n);
  }
}

TEST(RayCrossings, OneUlpDecides) {
  const Triangles box = cube();
  Points<3> origins(3, 3);
  origins << std::nextafter(1.0, 0.0), 0.5, 0.5, 1, 0.5, 0.5, std::nextafter(1.0, 2.0), 0.5, 0.5;
  const std::vector<int> expected = {1, 0, 0};  // in the face: not crossed
  EXPECT_EQ(windings(box, origins), expected);
}

TEST(RayCrossings, AreSortedAndNameTheTriangle) {
  Points<3> origins(2, 3);
  origins << -1, 0.25, 0.5, 0.5, 0.25, 0.5;
  const auto found = ray_crossings(cube(), origins);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].ray, 0);
  EXPECT_EQ(found[2].ray, 1);
  EXPECT_LT(found[0].element, found[1].element);
  EXPECT_EQ(found[0].sign, -1);  // in through x = 0
  EXPECT_EQ(found[1].sign, 1);
  EXPECT_EQ(found[2].element, found[1].element);
}

TEST(RayCrossings, NoRaysOrNoTrianglesGiveNone) {
  EXPECT_TRUE(ray_crossings(cube(), Points<3>(0, 3)).empty());
  EXPECT_TRUE(ray_crossings({Points<3>(0, 3), Elements<3>(0, 3)}, Points<3>::Zero(2, 3)).empty());
}

}  // namespace
}  // namespace surf::mesh
