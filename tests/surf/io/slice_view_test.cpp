// One slice: where its pixels lie in the world, and what is drawn there.
#include "libsurf/io/detail/slice_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/io/draw.h"
#include "libsurf/mesh/primitives.h"

namespace surf::io::detail {
namespace {

constexpr int kAxial = 0, kSagittal = 2;

/// 20 x 30 x 40 mm, of which a slice shows two axes.
const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-10, -15, -20), Eigen::Vector3d(10, 15, 20));

/// I = x + 100 y + 10000 z [mm].
volume::Volume coordinates() {
  std::vector<float> values;
  for (int z = -25; z <= 25; ++z)
    for (int y = -25; y <= 25; ++y)
      for (int x = -25; x <= 25; ++x) values.push_back(float(x + 100 * y + 10000 * z));
  return {{51, 51, 51}, Eigen::Affine3d(Eigen::Translation3d(-25, -25, -25)), values};
}

TEST(SliceView, HasThePixelsOfItsTwoAxes) {
  const SliceView axial(kViews[kAxial], kBox, {0, 0, 0}, 0.5);
  EXPECT_EQ(axial.width(), 40);
  EXPECT_EQ(axial.height(), 60);
  const SliceView sagittal(kViews[kSagittal], kBox, {0, 0, 0}, 0.5);
  EXPECT_EQ(sagittal.width(), 60);
  EXPECT_EQ(sagittal.height(), 80);
  EXPECT_EQ(SliceView(kViews[kAxial], kBox, {0, 0, 0}, 1000).width(), 1) << "never nothing";
}

// The patient's right and front come first; a pixel's value is that of its centre.
TEST(SliceView, SamplesFromRightToLeftAndFromTheTopDown) {
  const SliceView axial(kViews[kAxial], kBox, {0, 0, 3}, 1);
  const std::vector<double> values = axial.sample(coordinates());
  ASSERT_EQ(values.size(), 20u * 30u);
  EXPECT_NEAR(values[0], 9.5 + 100 * 14.5 + 10000 * 3, 0.01);
  EXPECT_NEAR(values[1] - values[0], -1, 0.01);
  EXPECT_NEAR(values[20] - values[0], -100, 0.01);
  const SliceView sagittal(kViews[kSagittal], kBox, {3, 0, 0}, 1);
  EXPECT_NEAR(sagittal.sample(coordinates())[0], 3 + 100 * 14.5 + 10000 * 19.5, 0.01);
}

TEST(SliceView, OutsideTheVolumeThereIsBackground) {
  const Eigen::AlignedBox3d wide(Eigen::Vector3d::Constant(-40), Eigen::Vector3d::Constant(40));
  const SliceView view(kViews[kAxial], wide, {0, 0, 0}, 1);
  const std::vector<double> values = view.sample(coordinates());
  EXPECT_TRUE(std::isnan(values[0]));
  EXPECT_FALSE(std::isnan(values[40 * 80 + 40]));
  const Picture picture = view.draw(values, {-1e6, -1e5});  // all that is there is white
  EXPECT_EQ(picture.at(0, 0), kBackground);
  EXPECT_EQ(picture.at(40, 40), (Color{255, 255, 255}));
}

TEST(SliceView, OutlinesWhereTheSurfaceCrossesTheSliceAndNowhereElse) {
  const Triangles ball = mesh::ball({0, 0, 0}, 8, 1);
  const auto n_outlined = [&](double z) {
    const SliceView view(kViews[kAxial], kBox, {0, 0, z}, 0.25);
    Picture picture(view.width(), view.height());
    view.draw_outline(picture, ball);
    int n = 0;
    for (int y = 0; y < view.height(); ++y)
      for (int x = 0; x < view.width(); ++x) {
        if (picture.at(x, y)[0] < 200) continue;
        ++n;
        const double r = 0.25 * std::hypot(x - 39.5, y - 59.5);
        EXPECT_NEAR(r, std::sqrt(64 - z * z), 0.6) << "pixel " << x << ", " << y;
      }
    return n;
  };
  EXPECT_GT(n_outlined(0), 150);  // 2 pi 32 pixels, most of them
  EXPECT_GT(n_outlined(5), 100);
  EXPECT_EQ(n_outlined(9), 0);
}

TEST(SliceView, MarksAreCrossesInTheSliceAndRingsBeyondIfAskedFor) {
  const SliceView view(kViews[kAxial], kBox, {0, 0, 0}, 0.25);
  const auto drawn = [&](double z, bool is_inside, bool has_rings) {
    Picture picture(view.width(), view.height());
    view.draw_marks(picture, {{{0, 0, z}, is_inside}}, {.cross_mm = 1, .has_rings = has_rings});
    return picture;
  };
  const auto is_drawn = [](const Picture& picture, int x, int y) {
    return picture.at(x, y) != Color{0, 0, 0};
  };
  const Picture cross = drawn(0.9, true, true), ring = drawn(1.1, true, true);
  EXPECT_TRUE(is_drawn(cross, 45, 59)) << "an arm";
  EXPECT_FALSE(is_drawn(cross, 43, 62)) << "between two arms";
  EXPECT_TRUE(is_drawn(ring, 43, 59));
  EXPECT_FALSE(is_drawn(ring, 39, 59)) << "the place itself stays free";
  EXPECT_FALSE(is_drawn(drawn(1.1, true, false), 43, 59));
  const Color inside = cross.at(45, 59), outside = drawn(0, false, true).at(45, 59);
  EXPECT_GT(inside[1], inside[0]);
  EXPECT_GT(outside[0], outside[1]);
}

}  // namespace
}  // namespace surf::io::detail
