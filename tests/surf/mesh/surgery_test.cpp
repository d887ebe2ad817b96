#include "libsurf/mesh/surgery.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/base/threads.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/verify.h"
#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr double kEdge = 0.1, kResolution = 0.05;

std::vector<char> intersecting(const Triangles& surface) {
  std::vector<char> events(surface.elements.rows(), 0);
  for (const auto& [a, b] : self_intersections(surface)) events[a] = events[b] = 1;
  return events;
}

struct Outcome {
  Triangles surface;
  SurgeryReport report;
  std::vector<ComponentMeasures> parts;
};

/// Resolves the events and checks what must hold then.
Outcome resolved(const Triangles& surface, const std::vector<char>& events) {
  TriMesh mesh = to_mesh(surface);
  mark_longest_edges(mesh);
  Outcome out;
  out.report = operate(mesh, events, {.resolution_mm = kResolution});
  check_mesh(mesh);
  out.surface = to_triangles(mesh);
  EXPECT_EQ(out.report.n_unresolved, 0);
  EXPECT_TRUE(self_intersections(out.surface).empty());
  EXPECT_TRUE(degenerate_triangles(out.surface).empty());
  out.parts = measure_components(out.surface);
  return out;
}

/// Resolves all intersections.
Outcome resolved(const Triangles& surface) { return resolved(surface, intersecting(surface)); }

/// Volume that the sampling may add or take: a layer of a resolution round the patches.
double patch_tolerance(const Outcome& out) {
  double area = 0;
  for (const RebuiltRegion& region : out.report.regions)
    area += region.n_added * 0.5 * kResolution * kResolution;
  return area * kResolution;
}

TEST(Surgery, MakesOneSurfaceOfTwoBallsThatOverlap) {
  const double r = 1, d = 1.6;  // of the centres
  const Outcome out =
      resolved(joined({ball({0, 0, 0}, r, kEdge), ball({d, 0.03, 0.01}, r, kEdge)}));
  ASSERT_EQ(out.parts.size(), 1u);
  EXPECT_EQ(out.parts[0].genus(), 0);
  const double h = r - d / 2, lens = 2 * std::numbers::pi * h * h * (3 * r - h) / 3;
  EXPECT_NEAR(volume_mm3(out.surface), 2 * 4 * std::numbers::pi / 3 - lens,
              patch_tolerance(out) + 0.01 * 8);
  EXPECT_TRUE(verify(out.surface).passed()) << verify(out.surface).message();
  ASSERT_EQ(out.report.regions.size(), 1u);
  EXPECT_EQ(out.report.regions[0].change, TopologyChange::kMerging);
  EXPECT_FALSE(out.report.regions[0].is_whole);
}

// The three that overlap are smaller than the reach, so they are rebuilt whole, and the gap to the
// fourth is thinner than the resolution: what grows for them is joined to a sheet without an event.
TEST(Surgery, KeepsSmallBallsBesideAnotherSheet) {
  const std::vector<Triangles> balls = {
      ball({0.698, 0.161, 0.120}, 0.229, kEdge), ball({0.877, 0.676, 0.299}, 0.307, kEdge),
      ball({0.957, 0.331, 0.429}, 0.315, kEdge), ball({0.704, 0.540, -0.514}, 0.482, kEdge)};
  const Triangles all = joined(balls);
  TriMesh mesh = to_mesh(all);
  const SurgeryReport report = operate(mesh, intersecting(all), {.resolution_mm = 0.7 * kEdge});
  EXPECT_EQ(report.n_unresolved, 0);
  double volume = 0;
  for (const Triangles& one : balls) volume += volume_mm3(one);
  constexpr double kOverlaps = 0.039;  // share of the volume, from the formula of lenses
  EXPECT_NEAR(volume_mm3(to_triangles(mesh)), (1 - kOverlaps) * volume, 0.03 * volume);
}

TEST(Surgery, LeavesTheRestOfTheSurfaceBitForBit) {
  const Triangles before = joined({ball({0, 0, 0}, 1, kEdge), ball({1.9, 0, 0}, 1, kEdge)});
  const Outcome out = resolved(before);
  const auto corners = [](const Triangles& s, int t) {
    std::vector<double> all;
    for (int i = 0; i < 3; ++i)
      for (int axis = 0; axis < 3; ++axis) all.push_back(s.points(s.elements(t, i), axis));
    return all;
  };
  std::set<std::vector<double>> after;
  for (int t = 0; t < out.surface.elements.rows(); ++t) {
    auto c = corners(out.surface, t);
    for (int turn = 0; turn < 3; ++turn) {
      std::rotate(c.begin(), c.begin() + 3, c.end());
      after.insert(c);
    }
  }
  int n_far = 0;
  for (int t = 0; t < before.elements.rows(); ++t) {
    const auto c = corners(before, t);
    if (std::abs((c[0] + c[3] + c[6]) / 3 - 0.95) < 0.6) continue;
    ++n_far;
    EXPECT_TRUE(after.contains(c)) << "triangle " << t;
  }
  EXPECT_GT(n_far, 1000);
}

TEST(Surgery, GivesARingOfBallsAHandle) {
  std::vector<Triangles> balls;
  for (int k = 0; k < 6; ++k) {
    const double angle = 2 * std::numbers::pi * k / 6 + 0.1;
    balls.push_back(ball({std::cos(angle), std::sin(angle), 0.02 * k}, 0.56, kEdge));
  }
  const Outcome out = resolved(joined(balls));
  ASSERT_EQ(out.parts.size(), 1u);
  EXPECT_EQ(out.parts[0].genus(), 1);
}

// The handle that is there already is no reason to refuse what adds none.
TEST(Surgery, RefusesHandlesThatItWouldAddAlone) {
  const Triangles balls = joined({ball({4, 0, 0}, 0.5, kEdge), ball({4.8, 0, 0}, 0.5, kEdge)});
  const Triangles surface = joined({torus(1, 0.3, 60, 20), balls});
  TriMesh mesh = to_mesh(surface);
  mark_longest_edges(mesh);
  SurgeryOptions options;
  options.resolution_mm = kResolution;
  options.max_genus = 0;
  const SurgeryReport report = operate(mesh, intersecting(surface), options);
  EXPECT_EQ(report.n_unresolved, 0);
  EXPECT_TRUE(report.refused.empty());
  ASSERT_EQ(report.regions.size(), 1u);
  EXPECT_EQ(report.regions[0].change, TopologyChange::kMerging);
  EXPECT_EQ(measure_components(to_triangles(mesh)).size(), 2u);
}

TEST(Surgery, ClosesTheHoleOfATorusThatIsThinnerThanTheResolution) {
  // Through the axis of a neck or hole a surface passes without being inverted: it is the distance
  // of its sheets that tells.
  const Triangles surface = mesh::torus(0.5, 0.48, 120, 80);
  std::vector<char> events(surface.elements.rows(), 0);
  for (int t = 0; t < surface.elements.rows(); ++t)
    events[t] =
        surface.points(surface.elements(t, 0), 0) * surface.points(surface.elements(t, 0), 0) +
            std::pow(surface.points(surface.elements(t, 0), 1), 2) <
        0.03 * 0.03;
  ASSERT_GT(std::count(events.begin(), events.end(), 1), 0);
  const Outcome out = resolved(surface, events);
  ASSERT_EQ(out.parts.size(), 1u);
  EXPECT_EQ(out.parts[0].genus(), 0);
  EXPECT_EQ(out.report.regions.at(0).change, TopologyChange::kHandleClosing);
}

/// An ellipsoid with a neck at x = 0: radii across are multiplied by 1 - depth there.
Triangles dumbbell(double depth_y, double depth_z) {
  Triangles surface = ellipsoid({0, 0, 0}, Eigen::Vector3d(2, 0.6, 0.6).asDiagonal(), 0.07);
  for (auto row : surface.points.rowwise()) {
    const double at_neck = std::exp(-row[0] * row[0] / 0.1);
    row[1] *= 1 - depth_y * at_neck;
    row[2] *= 1 - depth_z * at_neck;
  }
  return surface;
}

void expect_two_balls(const Outcome& out) {
  ASSERT_EQ(out.parts.size(), 2u);
  EXPECT_EQ(out.report.regions.at(0).change, TopologyChange::kSplitting);
  for (const auto& part : out.parts) {
    EXPECT_EQ(part.genus(), 0);
    EXPECT_GT(part.volume_mm3, 0.5);
  }
}

TEST(Surgery, SplitsANeckThatIsTurnedInsideOut) {
  const Triangles surface = dumbbell(0, 1.3);
  expect_two_balls(resolved(surface, intersecting(surface)));
}

// What comes apart is told from what has a cavity more by the signs of volumes.
TEST(Surgery, SplitsANeckFarFromTheOrigin) {
  for (const Eigen::RowVector3d& far :
       {Eigen::RowVector3d(3e5, -4e5, 5e5), Eigen::RowVector3d(-3e5, 2e5, 4e5),
        Eigen::RowVector3d(2e5, 3e5, -5e5)}) {
    Triangles surface = dumbbell(0, 1.3);
    surface.points.rowwise() += far;
    expect_two_balls(resolved(surface, intersecting(surface)));
  }
}

TEST(Surgery, SplitsANeckThatIsThinnerThanTheResolution) {
  const Triangles surface = dumbbell(0.97, 0.97);
  std::vector<char> events(surface.elements.rows(), 0);
  for (int t = 0; t < surface.elements.rows(); ++t)
    events[t] = std::abs(surface.points(surface.elements(t, 0), 0)) < 0.05;
  expect_two_balls(resolved(surface, events));
}

TEST(Surgery, KeepsTheCavityBetweenShellsThatJoin) {
  // A bowl whose rim closes: two hemispherical shells that overlap leave a cavity.
  std::vector<Triangles> balls;
  for (int k = 0; k < 60; ++k) {  // Fibonacci lattice
    const double z = 1 - 2 * (k + 0.5) / 60, phi = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    balls.push_back(ball({r * std::cos(phi), r * std::sin(phi), z}, 0.35, kEdge));
  }
  const Outcome out = resolved(joined(balls));
  ASSERT_EQ(out.parts.size(), 2u);
  EXPECT_EQ(out.parts[0].genus() + out.parts[1].genus(), 0);
  const double inner = std::min(out.parts[0].volume_mm3, out.parts[1].volume_mm3);
  EXPECT_LT(inner, -4 * std::numbers::pi / 3 * std::pow(0.65, 3));  // balls bulge into it
  EXPECT_GT(inner, -4 * std::numbers::pi / 3);
}

TEST(Surgery, ResolvesRandomClustersOfBalls) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1), radius(0.3, 0.7);
  for (int round = 0; round < 12; ++round) {
    std::vector<Triangles> balls;
    for (int k = 0; k < 8; ++k)
      balls.push_back(
          ball({uniform(random), uniform(random), uniform(random)}, radius(random), kEdge));
    const Outcome out = resolved(joined(balls));
    EXPECT_FALSE(out.parts.empty()) << "round " << round;
  }
}

TEST(Surgery, ReportsVolumesThatAddUp) {
  const Triangles before = joined({ball({0, 0, 0}, 1, kEdge), ball({1.7, 0, 0}, 1, kEdge)});
  const Outcome out = resolved(before);
  double change = 0;
  for (const RebuiltRegion& region : out.report.regions) change += region.volume_change_mm3;
  EXPECT_NEAR(volume_mm3(out.surface) - volume_mm3(before), change, 1e-9);
}

TEST(Surgery, GivesTheSameBytesForAnyNumberOfThreads) {
  const Triangles before = joined({ball({0, 0, 0}, 1, kEdge), ball({1.7, 0, 0}, 1, kEdge)});
  const ThreadLimit one(1);
  const Outcome first = resolved(before);
  const ThreadLimit two(2);
  const Outcome second = resolved(before);
  EXPECT_EQ(first.surface.points, second.surface.points);
  EXPECT_EQ(first.surface.elements, second.surface.elements);
}

TEST(Surgery, RefusesAResolutionOfZero) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.3));
  EXPECT_THROW(operate(mesh, std::vector<char>(mesh.n_faces(), 0), {}), UsageError);
}

}  // namespace
}  // namespace surf::mesh
