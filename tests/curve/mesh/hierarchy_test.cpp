#include "libcurve/mesh/hierarchy.h"

#include <algorithm>

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

// From whichever order nodes and elements were in, as long as rings begin where they began.
TEST(CurveHierarchy, FileOrderIsRingAfterRing) {
  const Segments in_order =
      in_file_order(joined({disc(0, 3), hole(0, 2), hole(2.5, 0.1), disc(10, 1)}));
  const CurveHierarchy hierarchy = curve_hierarchy(in_order);
  ASSERT_EQ(hierarchy.components.size(), 4u);
  for (const Component& ring : hierarchy.components)
    for (int i = 0; i < ring.n_elements; ++i) {
      EXPECT_EQ(in_order.elements(ring.first_element + i, 0), ring.first_element + i);
      EXPECT_EQ(in_order.elements(ring.first_element + i, 1),
                ring.first_element + (i + 1) % ring.n_elements);
    }
  EXPECT_EQ(in_file_order(in_order).points, in_order.points);
  EXPECT_EQ(in_file_order(in_order).elements, in_order.elements);
  // Another region before the holes of the first one; first elements first, all else backwards.
  const Segments apart = joined({disc(0, 3), disc(10, 1), hole(0, 2), hole(2.5, 0.1)});
  std::vector<int> rows;
  for (const Component& part : curve_hierarchy(apart).components)
    rows.push_back(part.first_element);
  const std::size_t n_first = rows.size();
  for (int e = int(apart.elements.rows()) - 1; e >= 0; --e)
    if (std::find(rows.begin(), rows.begin() + n_first, e) == rows.begin() + n_first)
      rows.push_back(e);
  Segments mixed{apart.points.colwise().reverse(), apart.elements(rows, Eigen::all)};
  for (int& node : mixed.elements.reshaped()) node = int(apart.points.rows()) - 1 - node;
  const Segments back = in_file_order(mixed);
  EXPECT_EQ(back.elements, in_order.elements);
  EXPECT_EQ(back.points, in_order.points);
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
