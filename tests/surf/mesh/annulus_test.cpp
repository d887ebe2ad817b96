#include "libsurf/mesh/detail/annulus.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

namespace surf::mesh {
namespace {

/// Polygons on two circles of a plane, the outer one counter-clockwise, the inner one clockwise.
struct Rings {
  Points<3> points;
  std::vector<int> outer, inner;
};

Rings rings(int n, int m, double turn) {
  Rings out{Points<3>(n + m, 3), {}, {}};
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    out.points.row(i) << 2 * std::cos(angle), 2 * std::sin(angle), 0;
    out.outer.push_back(i);
  }
  for (int j = 0; j < m; ++j) {
    const double angle = turn - 2 * std::numbers::pi * j / m;
    out.points.row(n + j) << 1.5 * std::cos(angle), 1.5 * std::sin(angle), 0;
    out.inner.push_back(n + j);
  }
  return out;
}

class Annulus : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(Annulus, FillsTheRingOnceWithSidesThatRunAsAsked) {
  const auto [n, m] = GetParam();
  const Rings r = rings(n, m, 0.7);
  const auto triangles = annulus(r.points, r.outer, r.inner);
  ASSERT_EQ(triangles.size(), std::size_t(n + m));
  std::map<std::pair<int, int>, int> sides;
  double area = 0;
  for (const auto& t : triangles) {
    const Vector<3> a = r.points.row(t[0]), b = r.points.row(t[1]), c = r.points.row(t[2]);
    const double signed_area = (b - a).cross(c - a)[2] / 2;
    EXPECT_GT(signed_area, 0);
    area += signed_area;
    for (int i = 0; i < 3; ++i) ++sides[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [side, count] : sides) EXPECT_EQ(count, 1);
  for (int i = 0; i < n; ++i) EXPECT_EQ(sides.count({r.outer[i], r.outer[(i + 1) % n]}), 1u);
  for (int j = 0; j < m; ++j) EXPECT_EQ(sides.count({r.inner[j], r.inner[(j + 1) % m]}), 1u);
  const auto polygon = [](int k, double radius) {
    return k * radius * radius * std::sin(2 * std::numbers::pi / k) / 2;
  };
  EXPECT_NEAR(area, polygon(n, 2) - polygon(m, 1.5), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(OfSeveralSizes, Annulus,
                         testing::Values(std::tuple{12, 12}, std::tuple{30, 11}, std::tuple{14, 40},
                                         std::tuple{12, 9}));

}  // namespace
}  // namespace surf::mesh
