// Clicks are obstacles of the evolution of a curve.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"
#include "libsurf/base/threads.h"

namespace surf::curve {
namespace {

using segment::Click;
using segment::Side;

constexpr int kSize = 96;
constexpr double kRadius = 30;  // pixels of 1 mm
const Vector<2> kCentre(47.3, 48.1);

/// A disc of contrast 1 with an edge of deviation 1 pixel.
Image disc() {
  std::vector<float> values;
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i)
      values.push_back(
          float(std::erfc(((Vector<2>(i, j) - kCentre).norm() - kRadius) / std::sqrt(2.0)) / 2));
  return Image({kSize, kSize}, pixel_to_plane({1, 1}), values);
}

CurveOptions regions() {
  CurveOptions options;
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.01, {}}};
  return options;
}

CurveOptions from_the_edge() {
  CurveOptions options = regions();
  options.initial = circle(kCentre, kRadius, 1.5);
  return options;
}

constexpr double kReach = 8;  // pixels: further from a click and its foot on the circle is away

bool is_away(const Vector<2>& point, const Click<2>& click) {
  const Vector<2> foot = kCentre + kRadius * (click.point_mm - kCentre).normalized();
  return (point - click.point_mm).norm() > kReach && (point - foot).norm() > kReach;
}

void expect_obeyed(const CurveResult& result, const std::vector<Click<2>>& clicks,
                   double tolerance = 0.1) {
  const Verification check = verify(result.shape);
  EXPECT_TRUE(check.passed()) << check.message();
  const auto distance = make_setting(disc())->distance_to(result.shape);
  for (const Click<2>& click : clicks) {
    EXPECT_EQ(bool(mesh::are_inside<2>(result.shape, click.point_mm.transpose()).front()),
              click.side == Side::kInside);
    EXPECT_GE(distance(click.point_mm), 0.5) << click.point_mm.transpose();
  }
  for (const std::string& note : result.notes)
    EXPECT_EQ(note.find("not obeyed"), std::string::npos) << note;
  double furthest = 0;
  for (const auto row : result.shape.points.rowwise())
    if (std::all_of(clicks.begin(), clicks.end(),
                    [&](const Click<2>& click) { return is_away(row.transpose(), click); }))
      furthest = std::max(furthest, std::abs((row.transpose() - kCentre).norm() - kRadius));
  EXPECT_LT(furthest, tolerance);
  printf("%zu clicks: nearest %.3f pixel, away from them at most %.3f pixel off, %d steps\n",
         clicks.size(), distance(clicks.back().point_mm), furthest, result.n_steps());
}

TEST(CurveObstacles, AnOutsideClickInTheDiscStaysOutside) {
  const Vector<2> click = kCentre + 0.87 * kRadius * Vector<2>(0.6, 0.8);
  CurveOptions options = from_the_edge();
  options.outside_mm = {click};
  expect_obeyed(segment(disc(), options), {{click, Side::kOutside}});
}

TEST(CurveObstacles, AnInsideClickBeyondTheEdgeStaysInside) {
  const Vector<2> click = kCentre + (kRadius + 1.5) * Vector<2>(-0.6, 0.8);
  CurveOptions options = from_the_edge();
  options.seeds_mm = {kCentre, click};
  expect_obeyed(segment(disc(), options), {{kCentre, Side::kInside}, {click, Side::kInside}});
}

TEST(CurveObstacles, AFrontFromASeedStopsAtAnOutsideClick) {
  const Vector<2> click = kCentre + 0.8 * kRadius * Vector<2>(0.6, -0.8);
  CurveOptions options = regions();
  options.seeds_mm = {kCentre};
  options.outside_mm = {click};
  // The run ends before all of the curve is at rest: what pulls at the obstacle bounds its steps.
  constexpr double kOff = 0.5;
  expect_obeyed(segment(disc(), options), {{kCentre, Side::kInside}, {click, Side::kOutside}},
                kOff);
}

TEST(CurveObstacles, ClicksThatNothingComesNearChangeNothing) {
  CurveOptions options = regions();
  options.initial = circle(kCentre, 0.8 * kRadius, 1.5);
  const CurveResult without = segment(disc(), options);
  options.outside_mm = {{5, 5}, {90, 88}};
  const CurveResult with = segment(disc(), options);
  EXPECT_EQ(with.shape.points, without.shape.points);
  EXPECT_EQ(with.shape.elements, without.shape.elements);
}

TEST(CurveObstacles, TheResultIsTheSameForOneThreadAndThree) {
  CurveOptions options = from_the_edge();
  options.outside_mm = {kCentre + 0.87 * kRadius * Vector<2>(0.6, 0.8)};
  const auto run = [&](int n_threads) {
    const ThreadLimit limit(n_threads);
    return segment(disc(), options).shape;
  };
  EXPECT_EQ(run(1).points, run(3).points);
}

TEST(CurveObstacles, AClickThatCannotBeObeyedIsNoted) {
  CurveOptions options = from_the_edge();
  options.outside_mm = {kCentre};
  const CurveResult result = segment(disc(), options);
  EXPECT_TRUE(std::any_of(result.notes.begin(), result.notes.end(), [](const std::string& note) {
    return note.starts_with("click (47.3, 48.1) mm is not obeyed: it is inside the curve");
  }));
}

// What moves of the curve is a part with two ends.
TEST(CurveObstacles, AFurtherClickOfADialogueMovesAPartOfALargeCurve) {
  segment::Segmentation<2> dialogue(make_setting(disc()));
  const int object = dialogue.add_object();
  segment::Options<2> fine;
  fine.edge_length_mm = 0.022;
  fine.coarseness = 1;
  dialogue.set_options(object, fine);
  dialogue.add_click(object, {kCentre, Side::kInside});
  const Segments before = dialogue.evolve(object).shape;
  const Click<2> outside{kCentre + Vector<2>(kRadius - 3, 0), Side::kOutside};
  dialogue.add_click(object, outside);
  const segment::Result<2>& result = dialogue.evolve(object);
  EXPECT_TRUE(std::any_of(result.stages.begin(), result.stages.end(),
                          [](const auto& stage) { return stage.name == "amend"; }));
  EXPECT_TRUE(verify(result.shape).passed());
  EXPECT_FALSE(mesh::are_inside<2>(result.shape, outside.point_mm.transpose()).front());
  std::set<std::pair<double, double>> places;
  for (const auto& x : before.points.rowwise()) places.insert({x[0], x[1]});
  int n_kept = 0;
  for (const auto& x : result.shape.points.rowwise()) n_kept += int(places.count({x[0], x[1]}));
  EXPECT_GT(n_kept, int(before.points.rows()) / 2);
}

}  // namespace
}  // namespace surf::curve
