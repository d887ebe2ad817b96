// Pictures of slices: where the outline lies, what is grey, what is refused.
#include "libsurf/io/slices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/volume/phantom.h"

namespace surf::io {
namespace {

/// A ball of radius 12 mm in a box of 60 mm, on any grid.
volume::Volume ball_volume(const std::array<int, 3>& size = {61, 61, 61},
                           const Eigen::Vector3d& spacing_mm = {1, 1, 1}) {
  volume::PhantomOptions options;
  options.size = size;
  options.spacing_mm = spacing_mm;
  return volume::make_phantom(options);
}

bool is_grey(const Color& color) { return color[0] == color[1] && color[1] == color[2]; }
/// Red above all.
bool is_outline(const Color& color) { return color[0] > 180 && color[2] < 120; }

/// The first and last outlined pixel of a row, between two columns.
std::array<int, 2> outline_span(const Picture& picture, int y, int begin, int end) {
  std::array<int, 2> span = {-1, -1};
  for (int x = begin; x < end; ++x)
    if (is_outline(picture.at(x, y))) {
      if (span[0] < 0) span[0] = x;
      span[1] = x;
    }
  return span;
}

TEST(Slices, OutlineOfABallHasItsDiameterInEachSliceWhateverTheSpacing) {
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 1);
  constexpr double kTolerance = 3;  // pixels: the line is 2 wide, and soft
  for (const auto& spacing : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.5, 1, 3)}) {
    const volume::Volume volume = ball_volume(
        {int(60 / spacing[0]) + 1, int(60 / spacing[1]) + 1, int(60 / spacing[2]) + 1}, spacing);
    const Picture picture = draw_slices(ball, volume, {.width = 1200});
    // Three boxes of 40 mm (the ball and half its size on each side) share the width.
    const double pixels_per_mm = 1200.0 / 3 / 40;
    for (int slice = 0; slice < 3; ++slice) {
      const auto [first, last] =
          outline_span(picture, picture.height() / 2, slice * 400, (slice + 1) * 400);
      EXPECT_NEAR(last - first, 20 * pixels_per_mm, kTolerance) << "slice " << slice;
      EXPECT_NEAR(0.5 * (first + last), 400 * slice + 200, 6) << "slice " << slice;
    }
  }
}

TEST(Slices, PatientsRightIsOnTheLeft) {
  const Triangles ball = mesh::ball({8, 0, 0}, 4, 0.5);
  const Picture picture =
      draw_slices(ball, ball_volume(), {.center_ras_mm = Vector<3>(-4, 0, 0), .width = 1200});
  // Shown are x = -12 to 20 mm, 432 pixels of the axial slice; the ball's 4 to 12 mm lie in
  // the left half.
  const auto [first, last] = outline_span(picture, picture.height() / 2, 0, 400);
  ASSERT_GE(first, 0);
  EXPECT_LT(last, 220);
}

TEST(Slices, WindowMapsItsEndsToBlackAndWhite) {
  const Triangles ball = mesh::ball({0, 0, 0}, 20, 2);
  const volume::Volume volume = ball_volume();
  const std::array<int, 2> middle = {200, 200};
  for (const auto& [low, high, expected] :
       {std::array<double, 3>{0, 1, 255}, {1, 2, 0}, {0, 2, 128}}) {
    const Picture picture =
        draw_slices(ball, volume, {.window = std::array<double, 2>{low, high}, .width = 1200});
    const Color& color = picture.at(middle[0], picture.height() / 2);
    EXPECT_TRUE(is_grey(color));
    EXPECT_NEAR(color[0], expected, 1) << low << ".." << high;
  }
}

bool is_inside_mark(const Color& color) { return color[1] > 200 && color[0] < 160; }
bool is_outside_mark(const Color& color) {
  return color[0] > 200 && color[1] < 160 && color[2] > 160;
}

/// Bounds of the pixels of a kind in a part of the picture: left, right, top, bottom.
template <class Kind>
std::array<int, 4> bounds(const Picture& picture, int begin, int end, const Kind& is_of_kind) {
  std::array<int, 4> out = {picture.width(), -1, picture.height(), -1};
  for (int y = 0; y < picture.height(); ++y)
    for (int x = begin; x < std::min(end, picture.width()); ++x)
      if (is_of_kind(picture.at(x, y)))
        out = {std::min(out[0], x), std::max(out[1], x), std::min(out[2], y), std::max(out[3], y)};
  return out;
}

TEST(Slices, MarkIsACrossWhereItLiesInTheSliceAndARingElsewhere) {
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 1);
  SliceOptions options;
  options.width = 1212;  // 10 pixels per mm
  options.marks = {{Vector<3>(5, -4, 0), true}, {Vector<3>(-15, 8, 2), false}};
  const Picture picture = draw_slices(ball, ball_volume(), options);
  // The axial slice shows x = 20 to -20 mm from left to right and y = 20 to -20 downwards.
  const auto inside = bounds(picture, 0, 400, is_inside_mark);
  EXPECT_NEAR(0.5 * (inside[0] + inside[1]), 150, 2);
  EXPECT_NEAR(0.5 * (inside[2] + inside[3]), 240, 2);
  EXPECT_GE(inside[1] - inside[0], 13);  // a cross
  const auto outside = bounds(picture, 0, 400, is_outside_mark);
  EXPECT_NEAR(0.5 * (outside[0] + outside[1]), 350, 2);
  EXPECT_NEAR(0.5 * (outside[2] + outside[3]), 120, 2);
  EXPECT_LE(outside[1] - outside[0], 11);  // a ring: 2 mm off the slice
}

TEST(Slices, MarkFarFromTheSurfaceIsShown) {
  SliceOptions options;
  options.width = 1200;
  options.marks = {{Vector<3>(-28, 0, 0), false}};
  const Picture picture = draw_slices(mesh::ball({0, 0, 0}, 5, 1), ball_volume(), options);
  EXPECT_GE(bounds(picture, 0, picture.width(), is_outside_mark)[1], 0);
}

TEST(Sheet, ShowsSoManySlicesEvenlySpreadFromTheTopDown) {
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 0.5);
  SheetOptions options;
  options.n_slices = 5;
  options.columns = 3;
  options.width = 3 * 400 + 2 * 6;
  const Picture picture = draw_sheet(ball, ball_volume(), options);
  EXPECT_EQ(picture.width(), 1212);
  EXPECT_EQ(picture.height(), 2 * 400 + 6);
  for (int n = 0; n < 5; ++n) {
    const double z = 10 - (n + 0.5) / 5 * 20, diameter = 2 * std::sqrt(100 - z * z);
    const int left = n % 3 * 406, middle = n / 3 * 406 + 200;
    const auto [first, last] = outline_span(picture, middle, left, left + 400);
    EXPECT_NEAR(last - first, 10 * diameter, 4) << n;
  }
  // There is no sixth one.
  EXPECT_EQ(picture.at(2 * 406 + 200, 606), (Color{0, 0, 0}));
}

TEST(Sheet, PutsAMarkIntoTheNextSliceAndNoOther) {
  for (const auto& [plane, axis] :
       {std::pair{SlicePlane::kAxial, 2}, {SlicePlane::kCoronal, 1}, {SlicePlane::kSagittal, 0}}) {
    SheetOptions options;
    options.plane = plane;
    options.n_slices = options.columns = 4;
    options.width = 4 * 200 + 3 * 6;
    options.marks = {{2.0 * Vector<3>::Unit(axis), true}};  // in the slice from 5 to 0 mm
    const Picture picture = draw_sheet(mesh::ball({0, 0, 0}, 10, 1), ball_volume(), options);
    for (int n = 0; n < 4; ++n)
      EXPECT_EQ(bounds(picture, n * 206, n * 206 + 200, is_inside_mark)[1] >= 0, n == 1) << n;
  }
}

TEST(Sheet, RefusesNoSlicesTooManyAndTooSmallOnes) {
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 2);
  const volume::Volume volume = ball_volume();
  for (const auto& [n_slices, columns, width] :
       {std::array<int, 3>{0, 1, 500}, {401, 20, 2000}, {4, 0, 500}, {50, 50, 1000}, {4, 2, 50}}) {
    SheetOptions options;
    options.n_slices = n_slices;
    options.columns = columns;
    options.width = width;
    EXPECT_THROW(draw_sheet(ball, volume, options), UsageError) << n_slices << " " << columns;
  }
}

TEST(CtWindow, IsLevelAndWidthOfTheConsoles) {
  EXPECT_EQ(ct_window("soft-tissue"), (std::array<double, 2>{-160, 240}));
  EXPECT_EQ(ct_window("lung"), (std::array<double, 2>{-1350, 150}));
  EXPECT_EQ(ct_window("liver"), std::nullopt);
  for (const std::string& name : ct_windows()) EXPECT_TRUE(ct_window(name)) << name;
}

// Its faces are at 30.5 mm, the centres at 30.
TEST(Slices, PointsInTheOuterHalfOfABorderVoxelAreCutAtItsCentre) {
  const Triangles ball = mesh::ball({0, 0, 25}, 5, 1);
  SliceOptions options;
  options.width = 1200;
  options.center_ras_mm = Vector<3>(0, 0, 30.5);
  options.marks = {{Vector<3>(0, 0, 30.4), true}};
  const Picture picture = draw_slices(ball, ball_volume(), options);
  EXPECT_GE(bounds(picture, 0, 400, is_inside_mark)[1], 0);
  options.center_ras_mm = Vector<3>(0, 0, 30);
  EXPECT_TRUE(jpeg_bytes(picture, 90) == jpeg_bytes(draw_slices(ball, ball_volume(), options), 90));
  options.center_ras_mm = Vector<3>(0, 0, 30.51);
  EXPECT_THROW(draw_slices(ball, ball_volume(), options), UsageError);
}

TEST(Sheet, ShowsASurfaceInTheOuterHalfOfABorderVoxel) {
  SheetOptions options;
  options.window = std::array<double, 2>{-1, 1};
  const Picture picture = draw_sheet(mesh::ball({0, 0, 30.25}, 0.2, 0.05), ball_volume(), options);
  EXPECT_NEAR(picture.at(185, 185)[0], 128, 1) << "a value of the volume, 0";
}

TEST(Slices, ArePlacedByTheTrianglesNotByPointsThatNoneUses) {
  const Triangles ball = mesh::ball({5, 0, 0}, 5, 1);
  Triangles more = ball;
  more.points.conservativeResize(ball.points.rows() + 1, 3);
  more.points.bottomRows(1) << -25, 20, 28;
  const volume::Volume volume = ball_volume();
  EXPECT_TRUE(jpeg_bytes(draw_slices(more, volume), 90) ==
              jpeg_bytes(draw_slices(ball, volume), 90));
  EXPECT_TRUE(jpeg_bytes(draw_sheet(more, volume), 90) == jpeg_bytes(draw_sheet(ball, volume), 90));
}

TEST(Slices, RefuseASurfaceElsewhereAndAnEmptyWindow) {
  const volume::Volume volume = ball_volume();
  EXPECT_THROW(draw_slices(mesh::ball({500, 0, 0}, 10, 2), volume), UsageError);
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 2);
  EXPECT_THROW(draw_slices(ball, volume, {.window = std::array<double, 2>{2, 2}}), UsageError);
  EXPECT_THROW(draw_slices(ball, volume, {.width = 10}), UsageError);
}

}  // namespace
}  // namespace surf::io
