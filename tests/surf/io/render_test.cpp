// The 3-D picture: refused without a display; with one (ctest runs these under xvfb-run) the
// surface is in it.
#include "libsurf/io/render.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "libsurf/base/error.h"
#include "libsurf/mesh/primitives.h"

namespace surf::io {
namespace {

const Color kWhite = {255, 255, 255};

TEST(Render, ShowsABallInBothViewsAndWhiteRoundIt) {
  const Picture picture =
      render_surface(mesh::ball({30, -40, 50}, 12, 2), {.width = 400, .height = 200});
  ASSERT_EQ(picture.width(), 400);
  ASSERT_EQ(picture.height(), 200);
  for (const int center : {100, 300}) {
    EXPECT_NE(picture.at(center, 100), kWhite);
    EXPECT_GT(picture.at(center, 100)[0], 100) << "lit from the camera";
  }
  EXPECT_EQ(picture.at(3, 3), kWhite);
  EXPECT_EQ(picture.at(200, 100), kWhite);
}

TEST(Render, ColoursByNumbersOfThePoints) {
  const Triangles ball = mesh::ball({0, 0, 0}, 12, 2);
  RenderOptions options{.width = 400, .height = 200};
  options.colors = PointArray{"height_mm", ball.points.col(2)};
  options.range = {-12, 12};
  const Picture picture = render_surface(ball, options);
  // Yellow above, dark blue below.
  const Color top = picture.at(100, 30), bottom = picture.at(100, 165);
  EXPECT_GT(top[0], top[2] + 40);
  EXPECT_GT(bottom[2], bottom[1] + 10);
  options.colors->values.conservativeResize(5);
  EXPECT_THROW(render_surface(ball, options), InvalidMesh);
}

TEST(Render, FramesTheTrianglesNotPointsThatNoneUses) {
  Triangles ball = mesh::ball({0, 0, 0}, 12, 2);
  Points<3> points(ball.points.rows() + 1, 3);
  points << Eigen::RowVector3d(500, -700, 900), ball.points;
  ball.points = points;
  ball.elements.array() += 1;
  RenderOptions options{.width = 400, .height = 200};
  options.colors = PointArray{"height_mm", points.col(2)};
  options.range = {-12, 12};
  const Picture picture = render_surface(ball, options);
  const Color top = picture.at(100, 30), bottom = picture.at(100, 165);  // yellow, dark blue
  EXPECT_GT(top[0], top[2] + 40);
  EXPECT_GT(bottom[2], bottom[1] + 10);
}

TEST(Render, DrawsTheEdgesIfAsked) {
  RenderOptions options{.width = 400, .height = 200};
  const Triangles ball = mesh::ball({0, 0, 0}, 12, 6);
  const Picture plain = render_surface(ball, options);
  options.has_edges = true;
  const Picture edged = render_surface(ball, options);
  int n_darker = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 400; ++x) n_darker += edged.at(x, y)[0] + 60 < plain.at(x, y)[0];
  EXPECT_GT(n_darker, 500);
}

TEST(Render, RefusesNoTrianglesAndSizesOutOfRange) {
  EXPECT_THROW(render_surface({}), InvalidMesh);
  EXPECT_THROW(render_surface(mesh::ball({0, 0, 0}, 1, 1), {.width = 20}), UsageError);
}

TEST(Render, WithoutADisplayIsOneErrorNotTheEndOfTheProcess) {
  const char* display = std::getenv("DISPLAY");
  const std::string kept = display == nullptr ? "" : display;
  for (const char* name : {"", ":4711"}) {
    setenv("DISPLAY", name, 1);
    EXPECT_THROW(render_surface(mesh::ball({0, 0, 0}, 1, 1)), OutputError) << name;
  }
  setenv("DISPLAY", kept.c_str(), 1);
}

}  // namespace
}  // namespace surf::io
