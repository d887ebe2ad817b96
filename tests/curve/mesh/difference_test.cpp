#include "libcurve/mesh/difference.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve {
namespace {

constexpr double kGap = 0.02, kEdge = 1.5;

mesh::PartOptions<2> options() {
  return {.gap_mm = kGap, .min_content = 1, .min_thickness_mm = 0.5};
}

double area(const Segments& curves) {
  return fem::Geometry<2>(curves.points, curves.elements).enclosed();
}

Segments rough(Segments curves, double amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, amplitude);
  for (auto& x : curves.points.reshaped()) x += normal(random);
  return curves;
}

TEST(PartedCurves, LeaveApartWhatIsApart) {
  const Segments first = circle({0, 0}, 10, kEdge), second = circle({20.01, 0}, 10, kEdge);
  EXPECT_FALSE(do_overlap(first, second));
  const auto out = parted(first, second, options());
  EXPECT_FALSE(out.has_changed);
  EXPECT_EQ(out.shape.points, first.points);
}

TEST(PartedCurves, OverlapKnowsWhatLiesInside) {
  const Segments large = circle({0, 0}, 10, 1), small = circle({1, 2}, 2, 0.5);
  EXPECT_TRUE(do_overlap(large, small));
  EXPECT_TRUE(do_overlap(small, large));
  EXPECT_FALSE(do_overlap(joined({large, flipped(circle({0, 0}, 7, 1))}), small));
}

TEST(PartedCurves, AreCutAtTheOthersWall) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Vector<2> at(12 + 4 * uniform(random), 3 * uniform(random));
    const Segments first = rough(circle({0, 0}, 10, kEdge), 0.1, seed),
                   second = rough(circle(at, 8, kEdge), 0.1, seed + 100);
    const auto out = parted(second, first, options());
    ASSERT_TRUE(out.has_changed) << seed;
    EXPECT_TRUE(verify(out.shape).passed()) << seed << verify(out.shape).message();
    EXPECT_FALSE(do_overlap(out.shape, first)) << seed;
    EXPECT_NEAR(area(second) - area(out.shape), out.removed, 1e-9) << seed;
    const DistanceToCurves to_first(first), to_second(second);
    double gap = 0;
    for (const auto& x : out.shape.points.rowwise())
      if (to_second(x.transpose()) > kGap) gap = std::max(gap, to_first(x.transpose()));
    EXPECT_GT(gap, 0) << seed;
    EXPECT_LT(gap, 2 * kGap) << seed;
  }
}

TEST(PartedCurves, LeaveNothingOfATwin) {
  const Segments twin = circle({0, 0}, 10, kEdge);
  const auto out = parted(rough(twin, 0.05, 1), rough(twin, 0.05, 2), options());
  EXPECT_EQ(out.shape.elements.rows(), 0);
  EXPECT_GT(out.n_crumbs, 1);
}

TEST(PartedCurves, TakeAHoleRoundWhatLiesInside) {
  const Segments large = circle({0, 0}, 10, 1), small = circle({1, 2}, 2, 0.5);
  const auto out = parted(large, small, options());
  EXPECT_EQ(verify(out.shape).n_components, 2);
  EXPECT_NEAR(out.removed, area(small), 0.5);
  EXPECT_EQ(parted(small, large, options()).shape.elements.rows(), 0);
}

}  // namespace
}  // namespace surf::curve
