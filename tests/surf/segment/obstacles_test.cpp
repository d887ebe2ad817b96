// Clicks are obstacles of the evolution of a surface.
#include <gtest/gtest.h>

#include <algorithm>

#include "libsurf/base/threads.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

using Eigen::Vector3d;

constexpr int kSize = 48;
constexpr double kVoxel = 2.0 / (kSize - 1);
constexpr double kRadius = 0.6;

volume::PhantomOptions ball() {
  volume::PhantomOptions options;
  options.kind = volume::PhantomKind::kBall;
  options.size = {kSize, kSize, kSize};
  return options;
}

/// From a start on the ball's edge: a gradient flow of what the automatic energy is.
SegmentOptions from_the_edge() {
  SegmentOptions options;
  options.initial = mesh::ball(Vector3d::Zero(), kRadius, 1.5 * kVoxel);
  return options;
}

bool is_inside(const SegmentResult& result, const Vector3d& point) {
  return mesh::are_inside<3>(result.shape, Points<3>(point.transpose())).front() != 0;
}

/// Verified; each click on its side by half a voxel; without a note; and away from the clicks, by
/// more than `reach` voxels, on the edge of the ball.
void expect_obeyed(const SegmentResult& result, const std::vector<Click<3>>& clicks, double reach) {
  const auto setting = make_setting(volume::make_phantom(ball()));
  const Measures<3> measures = setting->measures(result.shape);
  EXPECT_TRUE(measures.passed) << measures.verdict;
  const auto distance = setting->distance_to(result.shape);
  for (const Click<3>& click : clicks) {
    EXPECT_EQ(is_inside(result, click.point_mm), click.side == Side::kInside);
    EXPECT_GE(distance(click.point_mm) / kVoxel, 0.5) << click.point_mm.transpose();
  }
  for (const std::string& note : result.notes)
    EXPECT_EQ(note.find("not obeyed"), std::string::npos) << note;
  double furthest = 0;
  int n = 0;
  for (const auto row : result.shape.points.rowwise()) {
    const bool is_far = std::all_of(clicks.begin(), clicks.end(), [&](const Click<3>& click) {
      return (row.transpose() - click.point_mm).norm() > reach * kVoxel;
    });
    if (!is_far) continue;
    furthest = std::max(furthest, std::abs(row.norm() - kRadius) / kVoxel);
    ++n;
  }
  EXPECT_GT(n, 100);
  EXPECT_LT(furthest, 0.1);
  ::testing::Test::RecordProperty("furthest_voxel", std::to_string(furthest));
  printf("%zu clicks: nearest %.3f voxel, away from them at most %.3f voxel off, %d steps\n",
         clicks.size(), clicks.empty() ? 0 : distance(clicks.back().point_mm) / kVoxel, furthest,
         result.n_steps());
}

constexpr double kReach = 8;  // voxels

TEST(Obstacles, AnOutsideClickInTheBallStaysOutside) {
  const auto volume = volume::make_phantom(ball());
  const Vector3d click = 0.8 * kRadius * Vector3d(1, 2, 2) / 3;
  SegmentOptions options = from_the_edge();
  options.outside_mm = {click};
  expect_obeyed(segment(volume, options), {{click, Side::kOutside}}, kReach);
}

TEST(Obstacles, AnInsideClickBeyondTheEdgeStaysInside) {
  const auto volume = volume::make_phantom(ball());
  const Vector3d click = (kRadius + 1.5 * kVoxel) * Vector3d(2, -1, 2) / 3;
  SegmentOptions options;
  options.seeds_mm = {Vector3d::Zero(), click};
  options.initial = from_the_edge().initial;
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  expect_obeyed(segment(volume, options),
                {{Vector3d::Zero(), Side::kInside}, {click, Side::kInside}}, kReach);
}

// From a seed ball the surface reaches the click on its way, and closes round it.
TEST(Obstacles, AFrontFromASeedBallStopsAtAnOutsideClick) {
  const auto volume = volume::make_phantom(ball());
  const Vector3d click = 0.8 * kRadius * Vector3d(-2, 1, 2) / 3;
  SegmentOptions options;
  options.seeds_mm = {Vector3d::Zero()};
  options.outside_mm = {click};
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  expect_obeyed(segment(volume, options),
                {{Vector3d::Zero(), Side::kInside}, {click, Side::kOutside}}, kReach);
}

TEST(Obstacles, ClicksThatNothingComesNearChangeNothing) {
  const auto volume = volume::make_phantom(ball());
  SegmentOptions options;
  options.initial = mesh::ball(Vector3d::Zero(), 0.9 * kRadius, 1.5 * kVoxel);
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  const SegmentResult without = segment(volume, options);
  options.outside_mm = {{0.9, 0.1, 0}, {-0.8, -0.8, 0.8}};
  const SegmentResult with = segment(volume, options);
  EXPECT_EQ(with.shape.points, without.shape.points);
  EXPECT_EQ(with.shape.elements, without.shape.elements);
}

TEST(Obstacles, TheResultIsTheSameForOneThreadAndThree) {
  const auto volume = volume::make_phantom(ball());
  SegmentOptions options = from_the_edge();
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  options.outside_mm = {0.8 * kRadius * Vector3d(1, 2, 2) / 3};
  const auto run = [&](int n_threads) {
    const ThreadLimit limit(n_threads);
    return segment(volume, options).shape;
  };
  const Triangles one = run(1), three = run(3);
  EXPECT_EQ(one.points, three.points);
  EXPECT_EQ(one.elements, three.elements);
}

TEST(Obstacles, AClickThatCannotBeObeyedIsNoted) {
  const auto volume = volume::make_phantom(ball());
  SegmentOptions options = from_the_edge();
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  options.outside_mm = {Vector3d(0.01, 0, 0)};  // the centre
  const SegmentResult result = segment(volume, options);
  EXPECT_TRUE(std::any_of(result.notes.begin(), result.notes.end(), [](const std::string& note) {
    return note.starts_with("click (0.01, 0, 0) mm is not obeyed: it is inside the surface");
  }));
}

}  // namespace
}  // namespace surf::segment
