#include "libcurve/segment/region_filter.h"

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

Segments disc(double x, double radius) { return circle({x, 0}, radius, 0.05); }
Segments hole(double x, double radius) { return flipped(disc(x, radius)); }

RegionFilter of_area(double least) {
  RegionFilter filter;
  filter.min_area_mm2 = least;
  return filter;
}
RegionFilter keeping(mesh::Keep keep, std::vector<Vector<2>> seeds = {}) {
  RegionFilter filter;
  filter.keep = keep;
  filter.seeds_mm = std::move(seeds);
  return filter;
}

/// A ring from 1 to 2 with an island of 0.5 in it, and a disc of 0.4 at x = 5.
struct RegionFilters : ::testing::Test {
  Segments curves = joined({disc(0, 2), hole(0, 1), disc(0, 0.5), disc(5, 0.4)});

  /// Filters and expects the area of a sum of discs with these signed radii.
  void expect_areas(const RegionFilter& filter, std::initializer_list<double> radii) {
    const auto [out, removed] = filtered(curves, filter);
    double expected = 0;
    for (const double r : radii) expected += std::copysign(enclosed(disc(0, std::abs(r))), r);
    EXPECT_NEAR(enclosed(out), expected, 1e-12);
    if (radii.size() > 0) expect_valid(out);
    int n_removed = 0;
    double area = 0;
    for (const RemovedRegion& part : removed) n_removed += part.n_curves, area += part.area_mm2;
    EXPECT_EQ(n_removed, 4 - int(radii.size()));
    EXPECT_NEAR(area, enclosed(curves) - expected, 1e-12);
  }
};

TEST_F(RegionFilters, KeepAllUnlessAsked) {
  const auto [out, removed] = filtered(curves, {});
  EXPECT_EQ(out.points, curves.points);
  EXPECT_EQ(out.elements, curves.elements);
  EXPECT_TRUE(removed.empty());
}

TEST_F(RegionFilters, FillHolesWithAllThatLiesInThem) {
  RegionFilter filter;
  filter.fill_holes = true;
  expect_areas(filter, {2, 0.4});
}

TEST_F(RegionFilters, RemoveWhatIsSmallerThanTheLeastArea) {
  expect_areas(of_area(0.6), {2, -1, 0.5});  // pi 0.4^2 = 0.503 goes
  expect_areas(of_area(0.9), {2, -1});       // pi 0.5^2 = 0.785 goes too
  expect_areas(of_area(100), {});
}

TEST_F(RegionFilters, KeepTheLargestWithItsHole) {
  expect_areas(keeping(mesh::Keep::kLargest), {2, -1});
}

TEST_F(RegionFilters, KeepWhatHoldsASeed) {
  expect_areas(keeping(mesh::Keep::kSeeded, {{1.5, 0}}), {2, -1});
  expect_areas(keeping(mesh::Keep::kSeeded, {{0, 0}}), {0.5});
  expect_areas(keeping(mesh::Keep::kSeeded, {{0, 0}, {5.1, 0.1}}), {0.5, 0.4});
  expect_areas(keeping(mesh::Keep::kSeeded, {{0.75, 0}}), {});  // in the hole
}

TEST_F(RegionFilters, FillBeforeTheyLookForSeeds) {
  RegionFilter filter = keeping(mesh::Keep::kSeeded, {{0.75, 0}});
  filter.fill_holes = true;
  expect_areas(filter, {2});
}

TEST_F(RegionFilters, TellWhatWentAndWhere) {
  RegionFilter filter = of_area(0.6);
  filter.fill_holes = true;
  const std::vector<RemovedRegion> removed = filtered(curves, filter).removed;
  ASSERT_EQ(removed.size(), 3u);
  EXPECT_EQ(removed[0].what, "filled hole");
  EXPECT_NEAR(removed[0].area_mm2, -enclosed(disc(0, 1)), 1e-12);
  EXPECT_EQ(removed[1].what, "region in a filled hole");
  EXPECT_NEAR(removed[1].area_mm2, enclosed(disc(0, 0.5)), 1e-12);
  EXPECT_EQ(removed[2].what, "small region");
  EXPECT_NEAR(removed[2].area_mm2, enclosed(disc(5, 0.4)), 1e-12);
  EXPECT_NEAR(removed[2].center_mm[0], 5, 1e-9);
  EXPECT_NEAR(removed[2].center_mm[1], 0, 1e-9);
}

TEST_F(RegionFilters, RefuseWhatHasNoSense) {
  EXPECT_THROW(filtered(curves, of_area(-1)), UsageError);
  EXPECT_THROW(filtered(curves, of_area(NAN)), UsageError);
  EXPECT_THROW(filtered(curves, keeping(mesh::Keep::kSeeded)), UsageError);
}

}  // namespace
}  // namespace surf::curve
