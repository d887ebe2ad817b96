#include "libsurf/mesh/difference.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "libsurf/base/error.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"

namespace surf::mesh {
namespace {

constexpr double kGap = 0.02, kEdge = 1.5;

PartOptions<3> options() {
  return {.gap_mm = kGap,
          .min_content = 1,
          .min_thickness_mm = 0.5,
          .rounded = [](const Triangles& surface) { return io::rounded_to_file(surface, ".stl"); }};
}

Triangles in_file(const Triangles& surface) { return io::rounded_to_file(surface, ".stl"); }

/// Vertices moved at random, as noise moves those of organs.
Triangles rough(Triangles surface, double amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, amplitude);
  for (auto& x : surface.points.reshaped()) x += normal(random);
  return in_file(surface);
}

/// Largest distance from the other one of vertices that `before` does not have.
double greatest_gap(const Triangles& after, const Triangles& before, const Triangles& other) {
  const DistanceToSurface to_before(before), to_other(other);
  double out = 0;
  for (Eigen::Index i = 0; i < after.points.rows(); ++i) {
    const Vector<3> x = after.points.row(i);
    if (to_before(x) > kGap) out = std::max(out, to_other(x));
  }
  return out;
}

TEST(Difference, OfTwoBallsLacksTheirLens) {
  const Triangles first = ball({0, 0, 0}, 10, 0.7), second = ball({12, 0, 0}, 8, 0.7);
  const Triangles rest = difference(first, second);
  EXPECT_TRUE(verify(rest).passed()) << verify(rest).message();
  // Two caps, of chords off by less than 1 %.
  const double d = 12, R = 10, r = 8;
  const double lens = std::numbers::pi * std::pow(R + r - d, 2) *
                      (d * d + 2 * d * (R + r) - 3 * (R - r) * (R - r)) / (12 * d);
  EXPECT_NEAR(volume_mm3(first) - volume_mm3(rest), lens, 0.02 * lens);
  EXPECT_TRUE(do_overlap(first, second));
  EXPECT_EQ(difference(ball({0, 0, 0}, 2, 0.5), first).elements.rows(), 0);
}

TEST(Difference, OverlapIsExactAndKnowsWhatLiesInside) {
  const Triangles large = ball({0, 0, 0}, 10, 1), small = ball({1, 2, 3}, 2, 0.5);
  EXPECT_TRUE(do_overlap(large, small));
  EXPECT_TRUE(do_overlap(small, large));
  EXPECT_FALSE(do_overlap(large, ball({13, 0, 0}, 2, 0.5)));
  const Triangles shell = joined({large, flipped(ball({0, 0, 0}, 7, 1))});
  EXPECT_FALSE(do_overlap(shell, small));
  const Triangles cube = box({0, 0, 0}, {1, 1, 1}, 1), beside = box({1, 0, 0}, {2, 1, 1}, 1);
  EXPECT_TRUE(do_overlap(cube, beside));  // they touch
}

TEST(Parted, LeavesApartWhatIsApart) {
  const Triangles first = in_file(ball({0, 0, 0}, 10, kEdge)),
                  second = in_file(ball({20.01, 0, 0}, 10, kEdge));
  const Parted<3> out = parted(first, second, options());
  EXPECT_FALSE(out.has_changed);
  EXPECT_EQ(out.shape.points, first.points);
  EXPECT_EQ(out.shape.elements, first.elements);
}

// What the wall is not near stays, bit for bit.
TEST(Parted, CutsAtTheOthersWall) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Vector<3> shift(120 + 40 * uniform(random), -300 * uniform(random), 800);
    const Vector<3> at(13 + 3 * uniform(random), 3 * uniform(random), 3 * uniform(random));
    const Triangles first = rough(ball(shift, 10, kEdge), 0.05, seed),
                    second = rough(ball(shift + at, 8, kEdge), 0.05, seed + 100);
    const Parted<3> out = parted(second, first, options());
    ASSERT_TRUE(out.has_changed) << seed;
    EXPECT_TRUE(verify(out.shape).passed()) << seed << verify(out.shape).message();
    EXPECT_FALSE(do_overlap(out.shape, first)) << seed;
    EXPECT_LT(greatest_gap(out.shape, second, first), 2 * kGap) << seed;
    EXPECT_NEAR(volume_mm3(second) - volume_mm3(out.shape), out.removed, 1e-9);
    const Triangles whole = joined({first, out.shape});
    Eigen::Index n_kept = 0;
    for (Eigen::Index i = 0; i < second.points.rows(); ++i)
      for (Eigen::Index j = 0; j < out.shape.points.rows(); ++j)
        if (second.points.row(i) == out.shape.points.row(j)) ++n_kept;
    EXPECT_GT(n_kept, second.points.rows() / 2) << seed;
    RecordProperty("min_angle", std::to_string(quality(out.shape).min_angle_deg));
    std::printf("seed %u: removed %.3g of %.4g, angle %.2g, gap %.4g\n", seed, out.removed,
                volume_mm3(second), quality(out.shape).min_angle_deg,
                greatest_gap(out.shape, second, first));
  }
}

// Walls that run along each other, in and out, as those of two organs in contact do.
TEST(Parted, CutsWallsThatRunAlongEachOther) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Triangles first = rough(box({0, 0, 0}, {20, 18, 16}, kEdge), 0.08, seed),
                    second = rough(box({20, 2, -3}, {34, 22, 14}, kEdge), 0.08, seed + 50);
    const Parted<3> out = parted(second, first, options());
    ASSERT_TRUE(out.has_changed) << seed;
    EXPECT_TRUE(verify(out.shape).passed()) << seed << verify(out.shape).message();
    EXPECT_FALSE(do_overlap(out.shape, first)) << seed;
    std::printf("seed %u: removed %.3g of %.4g, angle %.2g, crumbs %d\n", seed, out.removed,
                volume_mm3(second), quality(out.shape).min_angle_deg, out.n_crumbs);
  }
}

TEST(Parted, LeavesNothingOfATwin) {
  const Triangles twin = ball({0, 0, 0}, 10, kEdge);
  const Parted<3> out = parted(rough(twin, 0.05, 1), rough(twin, 0.05, 2), options());
  EXPECT_EQ(out.shape.elements.rows(), 0);
  EXPECT_GT(out.n_crumbs, 1);
}

}  // namespace
}  // namespace surf::mesh
