#include "libsurf/mesh/measure.h"

#include <gtest/gtest.h>

#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;
constexpr double kRounding = 1e-12;

TEST(Measure, CubeIsExact) {
  const Triangles surface = cube();
  EXPECT_NEAR(area_mm2(surface), 6, kRounding);
  EXPECT_NEAR(volume_mm3(surface), 1, kRounding);
  EXPECT_NEAR(volume_mm3(flipped(surface)), -1, kRounding);
  EXPECT_NEAR((centroid(surface) - Vector<3>(0.5, 0.5, 0.5)).norm(), 0, kRounding);
}

// The volume that it spans with one of its points is rounding, and a quotient of two of that may be
// anywhere.
TEST(Measure, TheCentroidOfAnOpenSurfaceIsThatOfItsArea) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Vector<3>(1, 2, -0.5).normalized()).toRotationMatrix();
  constexpr int n = 9;
  std::vector<Vector<3>> points;
  std::vector<std::array<int, 3>> elements;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      points.push_back(turn * Vector<3>(1.3 * (i - 4), 1.1 * (j - 4), 0) + Vector<3>(7, 8, 9));
      const int at = i * n + j;
      if (i + 1 == n || j + 1 == n) continue;
      elements.push_back({at, at + 1, at + n});
      elements.push_back({at + 1, at + n + 1, at + n});
    }
  for (const bool is_rounded : {false, true}) {  // as in an STL file
    Triangles sheet = to_triangles(points, elements);
    if (is_rounded) sheet.points = sheet.points.cast<float>().cast<double>().eval();
    EXPECT_NEAR((centroid(sheet) - Vector<3>(7, 8, 9)).norm(), 0, 1e-5);
  }
  // A hole of one triangle is no matter.
  EXPECT_NEAR((centroid(without_triangle(sphere({1, 2, 3}, 2, 4), 7)) - Vector<3>(1, 2, 3)).norm(),
              0, 0.01);
}

TEST(Measure, FarFromTheOriginLosesNothing) {
  const Triangles surface = moved(cube(), {4096, -8192, 65536});  // coordinates stay exact
  EXPECT_EQ(volume_mm3(surface), volume_mm3(cube()));
  EXPECT_EQ(area_mm2(surface), area_mm2(cube()));
}

TEST(Measure, SphereConvergesWithTheSquareOfTheEdge) {
  const double volume = 4 * std::numbers::pi / 3 * 8, area = 16 * std::numbers::pi;
  const auto errors = [&](int levels) {
    const Triangles surface = sphere({1, 2, 3}, 2, levels);
    EXPECT_NEAR((centroid(surface) - Vector<3>(1, 2, 3)).norm(), 0, kRounding);
    return std::pair(volume - volume_mm3(surface), area - area_mm2(surface));
  };
  const auto [volume_3, area_3] = errors(3);
  const auto [volume_4, area_4] = errors(4);
  EXPECT_NEAR(volume_3 / volume_4, 4, 0.2);
  EXPECT_NEAR(area_3 / area_4, 4, 0.2);
}

TEST(Measure, ComponentsAreCountedApart) {
  const Triangles surface = joined(joined(torus(3, 1, 40, 20), sphere({20, 0, 0}, 1, 3)),
                                   without_triangle(moved(cube(), {0, 30, 0}), 2));
  const std::vector<ComponentMeasures> parts = measure_components(surface);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].genus(), 1);
  EXPECT_EQ(parts[1].genus(), 0);
  EXPECT_EQ(parts[0].n_triangles, 1600);
  EXPECT_EQ(parts[1].n_vertices, 4 * 64 + 2);
  EXPECT_EQ(parts[2].n_border_edges, 3);
  EXPECT_EQ(parts[0].n_border_edges, 0);
  EXPECT_NEAR(parts[0].volume_mm3 + parts[1].volume_mm3,
              volume_mm3(torus(3, 1, 40, 20)) + volume_mm3(sphere({0, 0, 0}, 1, 3)), 1e-10);
}

TEST(Measure, ComponentsThatShareAVertexBothCountIt) {
  const auto parts = measure_components(welded(joined(cube(), moved(cube(), {1, 1, 1}))));
  ASSERT_EQ(parts.size(), 2u);
  for (const auto& part : parts) {
    EXPECT_EQ(part.n_vertices, 8);
    EXPECT_EQ(part.euler_characteristic(), 2);
  }
}

TEST(Measure, QualityOfTheCubeIsKnown) {
  const Quality found = quality(cube());
  EXPECT_NEAR(found.min_angle_deg, 45, kRounding);
  EXPECT_NEAR(found.max_angle_deg, 90, kRounding);
  EXPECT_EQ(found.share_above_25_deg, 1);
  EXPECT_NEAR(found.min_edge_mm, 1, kRounding);
  EXPECT_NEAR(found.max_edge_mm, std::sqrt(2.0), kRounding);
  EXPECT_NEAR(found.mean_edge_mm, (12 + 6 * std::sqrt(2.0)) / 18, kRounding);
}

TEST(Measure, SliversAreCounted) {
  const Triangles two =
      to_triangles({{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, -0.01, 0}}, {{0, 1, 2}, {1, 0, 3}});
  EXPECT_EQ(quality(two).share_above_25_deg, 0.5);
  EXPECT_EQ(quality({}).share_above_25_deg, 0);
}

TEST(Measure, AnglesAddUpTo180Degrees) {
  const Eigen::Vector3d angles = angles_deg({0, 0, 0}, {4, 0, 0}, {4, 3, 0});
  EXPECT_NEAR(angles.sum(), 180, kRounding * 180);
  EXPECT_NEAR(angles[1], 90, kRounding * 90);
  EXPECT_EQ(angles_deg({0, 0, 0}, {1, 0, 0}, {3, 0, 0}).minCoeff(), 0);
}

}  // namespace
}  // namespace surf::mesh
