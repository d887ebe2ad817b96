// Strokes of a label map: one click each, that the search and the evolution heed as a whole.
#include "libsurf/segment/marks.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tests/surf/segment/phantoms.h"

namespace surf::segment {
namespace {

template <int Dim>
ImageBox<Dim> grid(const std::array<int, Dim>& size) {
  ImageBox<Dim> out;
  out.size = size;
  out.index_to_world.setIdentity();
  out.index_to_world.linear() *= 2;
  out.index_to_world.translation().setConstant(-5);
  out.world_to_index = out.index_to_world.inverse();
  return out;
}

TEST(Strokes, AreTheConnectedPartsOfALabel) {
  const ImageBox<2> image = grid<2>({8, 6});
  const std::vector<float> labels = {0, 2, 0, 0, 0, 0, 0, 0,  //
                                     0, 0, 2, 0, 0, 1, 1, 0,  //
                                     0, 0, 0, 2, 0, 0, 0, 1,  //
                                     0, 0, 0, 1, 0, 0, 0, 0,  //
                                     2, 0, 0, 0, 0, 0, 0, 0,  //
                                     2, 2, 0, 0, 0, 0, 2, 2};
  const auto clicks = strokes<2>(image, labels);
  ASSERT_EQ(clicks.size(), 5u);
  EXPECT_EQ(clicks[0].side, Side::kInside);  // corners join
  EXPECT_EQ(clicks[0].stroke_mm.size(), 2u);
  EXPECT_EQ(clicks[0].point_mm, Vector<2>(2 * 6 - 5, 2 * 1 - 5));  // nearest to its centre
  EXPECT_EQ(clicks[1].side, Side::kInside);
  EXPECT_TRUE(clicks[1].stroke_mm.empty());
  EXPECT_EQ(clicks[1].point_mm, Vector<2>(2 * 3 - 5, 2 * 3 - 5));
  for (const std::size_t n : {2, 3, 4}) EXPECT_EQ(clicks[n].side, Side::kOutside);
  EXPECT_EQ(clicks[2].stroke_mm.size(), 2u);  // of equal ones the first
  EXPECT_EQ(clicks[2].point_mm, Vector<2>(2 * 2 - 5, 2 * 1 - 5));
  EXPECT_EQ(clicks[3].stroke_mm.size(), 2u);
  EXPECT_EQ(clicks[4].stroke_mm.size(), 1u);
}

TEST(Strokes, OfManyVoxelsAreThinned) {
  const ImageBox<3> image = grid<3>({30, 30, 30});
  const auto clicks = strokes<3>(image, std::vector<float>(27000, 1));
  ASSERT_EQ(clicks.size(), 1u);
  EXPECT_LE(clicks[0].stroke_mm.size(), kMostPointsOfStroke);
  EXPECT_GE(clicks[0].stroke_mm.size(), kMostPointsOfStroke / 2);
  std::vector<float> line(27000, 0);
  for (int i = 0; i < 30; ++i) line[std::size_t(i)] = 2;
  EXPECT_EQ(strokes<3>(image, line)[0].stroke_mm.size(), 29u);  // thin ones stay whole
}

TEST(Strokes, AreRefusedWhereTheyCannotBeRead) {
  const ImageBox<2> image = grid<2>({4, 3});
  std::vector<float> labels(12, 0);
  EXPECT_THROW(strokes<2>(image, labels), InputError);
  labels[6] = 3;
  try {
    strokes<2>(image, labels);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("label 3 at pixel (2, 1)"), std::string::npos)
        << error.what();
  }
  ImageBox<2> moved = image;
  EXPECT_NO_THROW(check_same_grid<2>(image, moved));
  moved.index_to_world.translation()[0] += 1e-3;  // 0.5e-3 pixels
  EXPECT_NO_THROW(check_same_grid<2>(image, moved));
  moved.index_to_world.translation()[0] += 2e-3;
  EXPECT_THROW(check_same_grid<2>(image, moved), InputError);
  moved = image;
  moved.index_to_world.linear()(0, 1) = 0.01;  // a corner is off, the first pixel is not
  EXPECT_THROW(check_same_grid<2>(image, moved), InputError);
  try {
    check_same_grid<2>(image, grid<2>({4, 4}));
    FAIL();
  } catch (const InputError& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("4 x 3 pixels of 2 x 2 mm"), std::string::npos) << words;
    EXPECT_NE(words.find("4 x 4 pixels of 2 x 2 mm"), std::string::npos) << words;
  }
}

/// A line of points along the first axis.
Click<3> line(double from, double to, Side side, double y = 0) {
  Click<3> out{{(from + to) / 2, y, 0}, side};
  for (int n = 0; n <= 20; ++n) out.stroke_mm.push_back({from + (to - from) * n / 20, y, 0});
  return out;
}

// It is one click, its first point alone would find one ball, and all of it is in the result.
TEST(Strokes, ActAsOneClick) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int object = s.add_object();
  Click<3> both{{-0.5, 0, 0}, Side::kInside};
  both.stroke_mm = {{-0.45, 0, 0}, {0.5, 0, 0}};
  s.add_click(object, both);
  s.add_click(object, line(-0.3, 0.3, Side::kOutside, 0.6));
  EXPECT_EQ(s.object(object).clicks.size(), 2u);
  const Result<3>& result = s.evolve(object);
  ASSERT_TRUE(has_shape(result.outcome));
  EXPECT_EQ(result.search->clicks.size(), 2u);
  Points<3> points(3, 3);
  points << -0.5, 0, 0, -0.45, 0, 0, 0.5, 0, 0;
  for (const char is_inside : mesh::are_inside<3>(result.shape, points)) EXPECT_TRUE(is_inside);

  const std::string recipe = to_recipe<3>(s);
  Segmentation<3> again(make_setting(test::two_balls()));
  replay<3>(recipe, again);
  EXPECT_EQ(again.object(again.objects()[0]).clicks, s.object(object).clicks);
  EXPECT_EQ(again.object(again.objects()[0]).result->shape.points, result.shape.points);
  EXPECT_EQ(to_recipe<3>(again), recipe);
}

TEST(Strokes, AreObstaclesWithAllTheirPoints) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int object = s.add_object();
  s.add_click(object, {{-0.5, 0, 0}, Side::kInside});
  const Click<3> edge = line(-0.6, -0.4, Side::kOutside, 0.26);  // in the ball, near its edge
  s.add_click(object, edge);
  const Result<3>& result = s.evolve(object);
  Points<3> points(Eigen::Index(edge.stroke_mm.size()), 3);
  for (std::size_t n = 0; n < edge.stroke_mm.size(); ++n)
    points.row(Eigen::Index(n)) = edge.stroke_mm[n].transpose();
  for (const char is_inside : mesh::are_inside<3>(result.shape, points)) EXPECT_FALSE(is_inside);
}

// Inside ones not at any of their points; what outside ones say beyond the box is known.
TEST(Strokes, MayNotLeaveTheBox) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int object = s.add_object();
  Options<3> options;
  options.box_mm = {Vector<3>(-0.95, -0.45, -0.45), Vector<3>(0, 0.45, 0.45)};
  s.set_options(object, options);
  Click<3> both{{-0.5, 0, 0}, Side::kInside};
  both.stroke_mm = {{-0.5, 0, 0}, {0.5, 0, 0}};
  EXPECT_THROW(s.add_click(object, both), UsageError);
  s.add_click(object, {{-0.5, 0, 0}, Side::kInside});
  s.add_click(object, line(-0.1, 0.5, Side::kOutside));
  const Result<3>& result = s.evolve(object);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  EXPECT_LT(result.shape.points.col(0).maxCoeff(), 0);
}

// What the box cuts off it is no other stroke: an evolution goes on beside it.
TEST(Strokes, ThatCrossTheBoxLetAnEvolutionGoOn) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int object = s.add_object();
  Options<3> options;
  options.box_mm = {Vector<3>(-0.95, -0.45, -0.45), Vector<3>(0, 0.45, 0.45)};
  s.set_options(object, options);
  s.add_click(object, {{-0.5, 0, 0}, Side::kInside});
  s.add_click(object, line(-0.1, 0.5, Side::kOutside));
  ASSERT_EQ(s.propose(object).outcome, Outcome::kProposed);
  EXPECT_EQ(s.step(object, 1).stages.front().name, "fit");
  EXPECT_EQ(s.step(object, 1).stages.front().name, "go on");
}

TEST(Strokes, MayNotContradictEachOther) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int first = s.add_object("first"), second = s.add_object("second");
  s.add_click(first, line(-0.6, -0.4, Side::kInside));
  EXPECT_THROW(s.add_click(first, line(-0.5, -0.5, Side::kOutside)), UsageError);
  EXPECT_THROW(s.add_click(second, line(-0.4, 0.4, Side::kInside)), UsageError);
  EXPECT_THROW(s.add_click(second, line(0.4, 3, Side::kInside)),
               UsageError);  // it leaves the volume
  EXPECT_TRUE(s.object(second).clicks.empty());
}

TEST(Clicks, AreLimitedInNumber) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int object = s.add_object();
  for (std::size_t n = 0; n < Segmentation<3>::kMostClicks; ++n)
    s.add_click(object, {{-0.5, 0, 0}, Side::kInside});
  EXPECT_THROW(s.add_click(object, {{-0.5, 0, 0}, Side::kInside}), UsageError);
  EXPECT_EQ(s.object(object).clicks.size(), Segmentation<3>::kMostClicks);
}

// Points every four voxels far beyond the object: mending begins anew round some of them, and what
// it then changed was not said to have changed, so that the evolution went on with other triangles.
TEST(Strokes, FarBeyondTheObjectEndInASoundSurface) {
  volume::PhantomOptions options;
  options.size = {48, 48, 48};
  options.spacing_mm = Vector<3>::Ones();
  Segmentation<3> segmentation(make_setting(volume::make_phantom(options)));
  Click<3> stroke;
  stroke.side = Side::kInside;
  stroke.point_mm = {-0.5, -0.5, -0.5};
  std::map<std::array<int, 3>, Vector<3>> blocks;
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 48; ++j)
      for (int i = 0; i < 48; ++i)
        if (const Vector<3> at(i - 23.5, j - 23.5, k - 23.5); at.norm() < 20)
          blocks.try_emplace({i / 4, j / 4, k / 4}, at);
  for (const auto& [block, at] : blocks)
    if (at != stroke.point_mm) stroke.stroke_mm.push_back(at);
  const int object = segmentation.add_object();
  segmentation.add_click(object, stroke);
  segmentation.evolve(object);
  EXPECT_TRUE(segmentation.measures(object).passed);
}

}  // namespace
}  // namespace surf::segment
