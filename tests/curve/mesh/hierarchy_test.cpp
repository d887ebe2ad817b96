#include "libcurve/mesh/hierarchy.h"

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

Segments disc(double x, double radius) { return circle({x, 0}, radius, 0.05); }
Segments hole(double x, double radius) { return flipped(disc(x, radius)); }

TEST(CurveHierarchy, FindsAreasParentsAndDepths) {
  const CurveHierarchy h = curve_hierarchy(
      joined({disc(0, 3), hole(0, 2), disc(0, 1), hole(0, 0.5), disc(10, 1), hole(0.75, 0.1)}));
  ASSERT_EQ(h.components.size(), 6u);
  const std::vector<int> depths = {0, 1, 2, 3, 0, 3};
  const std::vector<int> parents = {-1, 0, 1, 2, -1, 2};
  for (int n = 0; n < 6; ++n) {
    EXPECT_EQ(h.components[n].depth, depths[n]);
    EXPECT_EQ(h.components[n].parent.value_or(-1), parents[n]);
    EXPECT_TRUE(h.components[n].is_real());
    EXPECT_EQ(h.components[n].is_outward, depths[n] % 2 == 0);
  }
  EXPECT_NEAR(h.components[1].area_mm2, -4 * M_PI, 1e-2);
  EXPECT_NEAR(h.components[4].centre[0], 10, 1e-12);
  const std::vector<Region> parts = regions(h);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].holes, std::vector<int>{1});
  EXPECT_EQ(parts[1].holes, (std::vector<int>{3, 5}));
  EXPECT_NEAR(parts[1].area_mm2, M_PI * (1 - 0.25 - 0.01), 1e-2);
}

TEST(CurveHierarchy, NamesPhantomsByTheirWindingNumbers) {
  const CurveHierarchy h =
      curve_hierarchy(joined({disc(0, 3), disc(0, 2), hole(10, 1), hole(0, 1), hole(0, 0.5)}));
  const std::vector<int> before = {0, 1, -1, 1, 0};
  for (int n = 0; n < 5; ++n) EXPECT_EQ(h.components[n].winding_before, before[n]) << n;
}

TEST(CurveHierarchy, DropsPhantomsAndKeepsTheRestBitForBit) {
  const Segments real = joined({disc(0, 3), hole(0, 1)});
  const Segments curves = joined({hole(10, 1), disc(0, 3), hole(0, 1)});
  const CurveHierarchy h = curve_hierarchy(curves);
  std::vector<char> keep;
  for (const Component& part : h.components) keep.push_back(part.is_real());
  const Segments left = kept(curves, h, keep);
  EXPECT_EQ(left.points, real.points);
  EXPECT_EQ(left.elements, real.elements);
}

TEST(CurveHierarchy, NestsHundredsOfRings) {
  std::vector<Segments> parts;
  for (int k = 0; k < 300; ++k)
    parts.push_back(k % 2 == 0 ? circle({0, 0}, 301 - k, 3) : flipped(circle({0, 0}, 301 - k, 3)));
  const CurveHierarchy h = curve_hierarchy(joined(parts));
  for (int k = 0; k < 300; ++k) {
    EXPECT_EQ(h.components[k].depth, k);
    EXPECT_TRUE(h.components[k].is_real());
  }
}

TEST(CurveHierarchy, DecidesTinyAreasFarAwayExactly) {
  // 1e9 from the origin the rounded area of a triangle of 1e-7 is noise.
  Points<2> corners(3, 2);
  corners << 0, 0, 1, 0, 0, 1;
  corners = (corners.array() * 0x1p-22).matrix().rowwise() + Eigen::RowVector2d(1e9, 1e9);
  EXPECT_TRUE(curve_hierarchy(polygon(corners, 1)).components[0].is_outward);
  EXPECT_FALSE(curve_hierarchy(flipped(polygon(corners, 1))).components[0].is_outward);
}

TEST(CurveHierarchy, RefusesOpenCurves) {
  Segments open = disc(0, 1);
  open.elements.conservativeResize(open.elements.rows() - 1, 2);
  EXPECT_THROW(curve_hierarchy(open), InvalidMesh);
}

}  // namespace
}  // namespace surf::curve
