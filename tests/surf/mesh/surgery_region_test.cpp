#include "libsurf/mesh/detail/surgery_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libsurf/mesh/detail/rims.h"
#include "libsurf/mesh/self_intersections.h"
#include "surfaces.h"

namespace surf::mesh {
namespace {

constexpr double kEdge = 0.1, kResolution = 0.05;
constexpr double kReach = 0.2;

/// Two balls of radius 1 and the triangles that cross.
struct TwoBalls {
  const ConnectedSurface surface;
  TriangleFlags is_event;
  RegionRequest request;

  explicit TwoBalls(double distance)
      : surface(
            to_mesh(joined({ball({0, 0, 0}, 1, kEdge), ball({distance, 0.013, 0.007}, 1, kEdge)}))),
        is_event(surface.n_triangles(), 0) {
    for (const auto& [a, b] : self_intersections(surface.triangles)) is_event[a] = is_event[b] = 1;
    for (int t = 0; t < surface.n_triangles(); ++t)
      if (is_event[t]) request.events.push_back(t);
    request.reach_mm = kReach;
  }
  RegionPlan plan(double resolution = kResolution) const {
    LargeParts large(surface, is_event);
    return plan_region(surface, large, is_event, request, resolution);
  }
};

std::vector<std::array<int, 3>> staying(const ConnectedSurface& surface,
                                        const std::vector<int>& removed) {
  std::vector<std::array<int, 3>> out;
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (!std::binary_search(removed.begin(), removed.end(), t))
      out.push_back({surface.vertex(t, 0), surface.vertex(t, 1), surface.vertex(t, 2)});
  return out;
}

class PlanOfTwoBalls : public testing::TestWithParam<double> {};

TEST_P(PlanOfTwoBalls, RemovesTheEventsAndNothingFarFromThem) {
  const TwoBalls balls(GetParam());
  ASSERT_FALSE(balls.request.events.empty());
  const RegionPlan plan = balls.plan();
  ASSERT_EQ(plan.state, RegionPlan::State::kFits);
  const std::vector<int>& removed = plan.patch.removed;
  EXPECT_TRUE(std::is_sorted(removed.begin(), removed.end()));
  EXPECT_TRUE(std::ranges::includes(removed, balls.request.events));
  // The reach, a cell round it, two rings and chords of them.
  constexpr double kFar = kReach + 2 * kResolution + 4 * kEdge;
  const double half = GetParam() / 2, circle = std::sqrt(1 - half * half);
  for (const int t : removed) {
    const Vector<3> x = balls.surface.centroid(t);
    const double radial = std::hypot(x[1], x[2]);
    const bool is_inside_the_circle = radial < circle && std::abs(x[0] - half) < 1 - half + kEdge;
    EXPECT_TRUE(is_inside_the_circle || std::hypot(x[0] - half, radial - circle) < kFar) << x;
  }
}

TEST_P(PlanOfTwoBalls, HasAPatchThatClosesTheSurface) {
  const TwoBalls balls(GetParam());
  const RegionPlan plan = balls.plan();
  ASSERT_EQ(plan.state, RegionPlan::State::kFits);
  const auto holes = rims(free_sides(staying(balls.surface, plan.patch.removed)));
  ASSERT_TRUE(holes);
  EXPECT_EQ(holes->size(), 2u);  // one in each ball
  std::vector<std::array<int, 3>> all = staying(balls.surface, plan.patch.removed);
  all.insert(all.end(), plan.patch.triangles.begin(), plan.patch.triangles.end());
  EXPECT_TRUE(free_sides(all).empty());
  // Of one sphere: V - F / 2 = 2.
  std::vector<char> is_used(balls.surface.n_vertices() + plan.patch.points.size(), 0);
  for (const auto& triangle : all)
    for (const int v : triangle) is_used[v] = 1;
  EXPECT_EQ(std::count(is_used.begin(), is_used.end(), 1) - int(all.size()) / 2, 2);
}

INSTANTIATE_TEST_SUITE_P(OfSeveralOverlaps, PlanOfTwoBalls, testing::Values(1.97, 1.9, 1.6));

TEST(PlanOfRegion, OfAWholeBallIsABall) {
  const ConnectedSurface surface(to_mesh(ball({0, 0, 0}, 1, kEdge)));
  TriangleFlags is_event(surface.n_triangles(), 0);
  is_event[0] = 1;
  LargeParts large(surface, is_event);
  const RegionPlan plan = plan_region(
      surface, large, is_event,
      {.events = {0}, .others = {}, .reach_mm = std::numeric_limits<double>::infinity()},
      kResolution);
  ASSERT_EQ(plan.state, RegionPlan::State::kFits);
  EXPECT_EQ(plan.patch.removed.size(), std::size_t(surface.n_triangles()));
  EXPECT_TRUE(free_sides(plan.patch.triangles).empty());
  EXPECT_EQ(int(plan.patch.points.size()) - int(plan.patch.triangles.size()) / 2, 2);
}

TEST(PlanOfRegion, FailsWithTooManyNodes) {
  const TwoBalls balls(1.9);
  EXPECT_EQ(balls.plan(1e-4).state, RegionPlan::State::kFails);
}

/// The lens between the balls is asked for the events of the other region that it borders on.
TEST(PlanOfRegion, WantsTheOtherEventsOfItsPhantomPart) {
  TwoBalls balls(1.6);
  std::vector<int>& events = balls.request.events;
  const std::vector<int> all = events;
  std::erase_if(events, [&](int t) { return balls.surface.centroid(t)[2] < 0.4; });
  ASSERT_LT(events.size(), all.size());
  const RegionPlan plan = balls.plan();
  ASSERT_EQ(plan.state, RegionPlan::State::kWantsMore);
  for (const int t : plan.wanted) {
    EXPECT_TRUE(balls.is_event[t]);
    EXPECT_FALSE(std::binary_search(events.begin(), events.end(), t));
  }
  EXPECT_FALSE(plan.wanted.empty());
}

}  // namespace
}  // namespace surf::mesh
