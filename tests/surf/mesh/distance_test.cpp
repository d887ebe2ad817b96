#include "libsurf/mesh/distance.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;

/// [0, 1]^2 at height z, two triangles.
Triangles square(double z) {
  return to_triangles({{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}}, {{0, 1, 2}, {0, 2, 3}});
}

TEST(Distance, OfAPointIsExact) {
  const DistanceToSurface distance(cube());
  EXPECT_DOUBLE_EQ(distance({0.5, 0.5, 3}), 2);
  EXPECT_DOUBLE_EQ(distance({2, 2, 2}), std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(distance({0.5, 0.5, 0.25}), 0.25);
  EXPECT_DOUBLE_EQ(distance({-3, -4, 0.5}), 5);
}

TEST(Distance, BetweenParallelSquaresIsTheirGap) {
  const SurfaceDistances found = surface_distances(square(0), square(0.25));
  for (const double value : {found.mean_mm, found.rms_mm, found.p95_mm, found.max_mm})
    EXPECT_NEAR(value, 0.25, 1e-12);
}

TEST(Distance, BetweenConcentricSpheresIsTheDifferenceOfRadii) {
  // The inscribed surfaces lie up to r (1 - cos(h)) inside: 2e-3 for 1/32 of a quarter turn.
  constexpr double kInscribed = 3e-3;
  const SurfaceDistances found =
      surface_distances(sphere({0, 0, 0}, 2, 5), sphere({0, 0, 0}, 3, 5));
  EXPECT_NEAR(found.mean_mm, 1, kInscribed);
  EXPECT_NEAR(found.p95_mm, 1, kInscribed);
  EXPECT_NEAR(found.max_mm, 1, kInscribed);
}

// A square against itself turned up along one side: distances in each direction are known.
TEST(Distance, StatisticsOfALinearDistanceAreKnown) {
  constexpr double kSampling = 1e-4;  // 10 / n_samples
  const DistanceStatistics found =
      distances_from(square(0), [](const Vector<3>& p) { return p[0] - 0.25; });
  EXPECT_NEAR(found.signed_mean_mm, 0.25, kSampling);
  EXPECT_NEAR(found.mean_mm, (0.25 * 0.25 + 0.75 * 0.75) / 2, kSampling);
  EXPECT_NEAR(found.rms_mm, std::sqrt((std::pow(0.25, 3) + std::pow(0.75, 3)) / 3), kSampling);
  EXPECT_NEAR(found.p95_mm, 0.70, kSampling);
  EXPECT_EQ(found.max_mm, 0.75);  // at a vertex
}

TEST(Distance, SamplesFollowTheAreaAndNotTheTriangles) {
  // The left half as 2 triangles, the right half as 200.
  Triangles surface =
      to_triangles({{0, 0, 0}, {0.5, 0, 0}, {0.5, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}});
  for (int k = 0; k < 100; ++k) {
    const double y = k / 100.0, top = (k + 1) / 100.0;
    surface = joined(surface, to_triangles({{0.5, y, 0}, {1, y, 0}, {1, top, 0}, {0.5, top, 0}},
                                           {{0, 1, 2}, {0, 2, 3}}));
  }
  const DistanceStatistics found =
      distances_from(surface, [](const Vector<3>& p) { return p[0] < 0.5 ? 0.0 : 1.0; });
  EXPECT_NEAR(found.mean_mm, 0.5, 1e-4);
}

// One direction alone misses what the other surface has more.
TEST(Distance, BothDirectionsCount) {
  const Triangles one = sphere({0, 0, 0}, 1, 3), two = joined(one, sphere({10, 0, 0}, 1, 3));
  const SurfaceDistances found = surface_distances(one, two);
  EXPECT_EQ(found.forward.max_mm, 0);
  EXPECT_NEAR(found.backward.max_mm, 10, 0.2);
  EXPECT_EQ(found.max_mm, found.backward.max_mm);
  EXPECT_EQ(found.p95_mm, found.backward.p95_mm);
  EXPECT_NEAR(found.mean_mm, found.backward.mean_mm * 2 / 3, 1e-9);
  const SurfaceDistances back = surface_distances(two, one);
  EXPECT_EQ(back.mean_mm, found.mean_mm);
  EXPECT_EQ(back.max_mm, found.max_mm);
}

TEST(Distance, IsTheSameTwice) {
  const Triangles one = sphere({0, 0, 0}, 1, 4), two = torus(1, 0.3, 60, 30);
  const SurfaceDistances a = surface_distances(one, two), b = surface_distances(one, two);
  EXPECT_EQ(a.mean_mm, b.mean_mm);
  EXPECT_EQ(a.rms_mm, b.rms_mm);
  EXPECT_EQ(a.p95_mm, b.p95_mm);
}

TEST(Distance, IgnoresDegenerateTrianglesAndRefusesNothingElse) {
  Triangles flat = square(0);
  flat.elements.row(0) << 0, 1, 1;
  EXPECT_NEAR(surface_distances(flat, flat).max_mm, 1 / std::sqrt(2.0), 1e-12);  // vertex 1
  flat.elements.row(1) << 0, 0, 0;
  EXPECT_THROW(surface_distances(flat, square(0)), InvalidMesh);
  EXPECT_THROW(surface_distances(square(0), flat), InvalidMesh);
}

}  // namespace
}  // namespace surf::mesh
