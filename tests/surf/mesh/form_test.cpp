#include "libsurf/mesh/form.h"

#include <gtest/gtest.h>

#include <random>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/region_intensities.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;
constexpr double kDecimals = 1e-9;  // that the smallest diameter is rounded to

Triangles mapped(Triangles surface, const Eigen::Matrix3d& map, const Vector<3>& shift) {
  surface.points = (surface.points * map.transpose()).rowwise() + shift.transpose();
  return surface;
}

Eigen::Matrix3d some_turn() {
  return Eigen::AngleAxisd(0.7, Vector<3>(1, 2, -0.5).normalized()).toRotationMatrix();
}

TEST(Form, OfABoxIsExact) {
  const Eigen::Matrix3d turn = some_turn();
  const Form found = form(mapped(cube(), turn * Vector<3>(4, 10, 7).asDiagonal(), {30, -20, 5}));
  const double area = 2 * (40 + 28 + 70);
  EXPECT_NEAR(found.sphericity, std::cbrt(36 * std::numbers::pi * 280 * 280) / area, 1e-12);
  EXPECT_NEAR(found.feret.largest_mm, std::sqrt(16 + 100 + 49), 1e-12);
  EXPECT_NEAR(found.feret.smallest_mm, 4, kDecimals);
  EXPECT_NEAR(std::abs(found.feret.smallest_direction.dot(turn.col(0))), 1, kDecimals);
  EXPECT_NEAR((found.feret.largest_to_mm - found.feret.largest_from_mm).norm(),
              found.feret.largest_mm, 1e-12);
  // A box of side s has the variance s^2 / 12.
  const Vector<3> semi_axes = Vector<3>(10, 7, 4) * std::sqrt(5.0 / 12);
  EXPECT_NEAR((found.axes.semi_axes_mm - semi_axes).norm(), 0, 1e-12);
  EXPECT_NEAR(std::abs(found.axes.directions.col(0).dot(turn.col(1))), 1, 1e-12);
  EXPECT_NEAR(found.axes.elongation(), 10.0 / 7, 1e-12);
  EXPECT_NEAR(found.axes.flatness(), 7.0 / 4, 1e-12);
  EXPECT_NEAR(found.axes.directions.determinant(), 1, 1e-12);
}

TEST(Form, WidthOfATetrahedronLiesBetweenTwoEdges) {
  // Regular, of side sqrt(2): opposite edges are 1 apart, a corner 2 / sqrt(3) from its face.
  const Triangles regular = to_triangles({{0, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}},
                                         {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}});
  const FeretDiameters found = feret_diameters(mapped(regular, some_turn(), {1, 2, 3}));
  EXPECT_NEAR(found.smallest_mm, 1, kDecimals);
  EXPECT_NEAR(found.largest_mm, std::sqrt(2.0), 1e-12);
}

TEST(Form, OfASphereConvergesToItsDiameter) {
  const Form found = form(sphere({1, 2, 3}, 10, 5));
  EXPECT_NEAR(found.feret.largest_mm, 20, 1e-9);
  EXPECT_NEAR(found.feret.smallest_mm, 20, 0.02);
  EXPECT_LT(found.feret.smallest_mm, 20);
  EXPECT_NEAR(found.sphericity, 1, 0.001);
  EXPECT_NEAR(found.axes.semi_axes_mm[0], 10, 0.02);
}

TEST(Form, FeretDiametersAreThoseOfAllDirectionsAndPairs) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Vector<3>> points;
    for (int k = 0; k < 30; ++k)
      points.emplace_back(normal(random), 2 * normal(random), normal(random));
    std::vector<std::array<int, 3>> elements;
    for (int k = 0; k + 2 < 30; ++k) elements.push_back({k, k + 1, k + 2});
    const FeretDiameters found = feret_diameters(to_triangles(points, elements));
    double largest = 0, smallest = 1e9;
    const auto width = [&](const Vector<3>& n) {
      double low = 1e9, high = -1e9;
      for (const auto& p : points) low = std::min(low, n.dot(p)), high = std::max(high, n.dot(p));
      return high - low;
    };
    const auto try_normal = [&](const Vector<3>& n) {
      if (n.norm() > 1e-9) smallest = std::min(smallest, width(n.normalized()));
    };
    // Every face and every pair of edges, of the hull or not: none is thinner than the hull.
    for (int a = 0; a < 30; ++a)
      for (int b = 0; b < a; ++b) {
        largest = std::max(largest, (points[a] - points[b]).norm());
        for (int c = 0; c < 30; ++c)
          for (int d = 0; d < c; ++d)
            try_normal((points[a] - points[b]).cross(points[c] - points[d]));
      }
    EXPECT_NEAR(found.largest_mm, largest, 1e-12);
    EXPECT_NEAR(found.smallest_mm, smallest, kDecimals) << trial;
    EXPECT_NEAR(width(found.smallest_direction), found.smallest_mm, 1e-8);
  }
}

TEST(Form, WantsAVolume) {
  const Triangles flat =
      to_triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 3, 2}});
  EXPECT_THROW(feret_diameters(flat), InvalidMesh);
  EXPECT_THROW(principal_axes(flat), InvalidMesh);
  EXPECT_EQ(sphericity({}), 0);
}

TEST(RegionIntensities, AreThoseOfEveryVoxelByItsDistance) {
  const std::array<int, 3> size = {30, 26, 34};
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() = some_turn() * Vector<3>(0.8, 1.1, 0.7).asDiagonal();
  const Vector<3> center = to_world * Vector<3>(14, 13, 12);
  std::vector<float> values;
  std::size_t n_inside = 0, n_shell = 0;
  double inside = 0, shell = 0;
  const double radius = 6, thickness = 3;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const double r = (to_world * Vector<3>(i, j, k) - center).norm();
        values.push_back(float(i + 2 * j + 3 * k));
        if (r < radius) ++n_inside, inside += values.back();
        if (r > radius && r <= radius + thickness) ++n_shell, shell += values.back();
      }
  const volume::Volume volume(size, to_world, values);
  const RegionIntensities found = region_intensities(sphere(center, radius, 6), volume, thickness);
  EXPECT_NEAR(double(found.inside.n_voxels), double(n_inside), 1);
  EXPECT_NEAR(double(found.shell.n_voxels), double(n_shell), 2);
  EXPECT_NEAR(found.inside.mean, inside / double(n_inside), 0.05);
  EXPECT_NEAR(found.shell.mean, shell / double(n_shell), 0.05);
  EXPECT_LT(found.inside.percentile_5, found.inside.median);
  EXPECT_LT(found.inside.median, found.inside.percentile_95);
  const RegionIntensities none = region_intensities(sphere({900, 0, 0}, 6, 2), volume);
  EXPECT_EQ(none.inside.n_voxels + none.shell.n_voxels, 0u);
}

}  // namespace
}  // namespace surf::mesh
