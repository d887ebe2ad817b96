// Pictures of slices: where the outline lies, what is grey, what is refused.
#include "libsurf/io/slices.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(Slices, RefuseASurfaceElsewhereAndAnEmptyWindow) {
  const volume::Volume volume = ball_volume();
  EXPECT_THROW(draw_slices(mesh::ball({500, 0, 0}, 10, 2), volume), UsageError);
  const Triangles ball = mesh::ball({0, 0, 0}, 10, 2);
  EXPECT_THROW(draw_slices(ball, volume, {.window = std::array<double, 2>{2, 2}}), UsageError);
  EXPECT_THROW(draw_slices(ball, volume, {.width = 10}), UsageError);
}

}  // namespace
}  // namespace surf::io
