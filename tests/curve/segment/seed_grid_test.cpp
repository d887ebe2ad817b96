#include "libcurve/segment/seed_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/hierarchy.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

/// Twelve discs in the unit square of [-1, 1]; and the same in black and white reversed.
Image discs(bool are_dark) {
  const Image image = make_phantom({.kind = PhantomKind::kDiscs12, .size = {128, 128}});
  if (!are_dark) return image;
  std::vector<float> values;
  for (const float value : image.values()) values.push_back(1 - value);
  return {image.size(), image.pixel_to_plane(), values};
}

double mean_of(const Image& image) {
  const auto& values = image.values();
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

TEST(SeedGrid, LiesInTheObjectsBrightOrDark) {
  for (const bool are_dark : {false, true}) {
    const Image image = discs(are_dark);
    SeedGridOptions options;
    options.spacing_mm = 8;
    options.are_dark = are_dark;
    const CurveHierarchy hierarchy = curve_hierarchy(seed_grid(image, options));
    EXPECT_GE(hierarchy.components.size(), 12u);
    EXPECT_LT(hierarchy.components.size(), 16u * 16u / 2);
    for (const Component& circle : hierarchy.components) {
      const Eigen::Vector2d pixel = image.plane_to_pixel() * circle.centre;
      const float value = image.value(int(pixel[0] + 0.5), int(pixel[1] + 0.5));
      EXPECT_EQ(value > mean_of(image), !are_dark);
      EXPECT_NEAR(circle.length_mm, 2 * M_PI * 0.3 * 8, 0.5);
    }
  }
}

TEST(SeedGrid, RefusesCirclesThatTouchAndAGridWiderThanTheImage) {
  const Image image = discs(false);
  SeedGridOptions options;
  options.spacing_mm = 8;
  options.radius_mm = 4;
  EXPECT_THROW(seed_grid(image, options), UsageError);
  options.radius_mm.reset();
  options.spacing_mm = 900;
  EXPECT_THROW(seed_grid(image, options), UsageError);
  options.spacing_mm = 0;
  EXPECT_THROW(seed_grid(image, options), UsageError);
}

// 1.6e11 circles: memory ran full.
TEST(SeedGrid, RefusesMoreCirclesThanCanBeHeld) {
  SeedGridOptions options;
  options.spacing_mm = 128 / 4e5;
  EXPECT_THROW(seed_grid(discs(false), options), UsageError);
}

TEST(SeedGrid, SaysWhereNothingStandsOut) {
  const Image flat({20, 20}, pixel_to_plane({1, 1}), std::vector<float>(400, 5.0f));
  SeedGridOptions options;
  options.spacing_mm = 5;
  EXPECT_THROW(seed_grid(flat, options), UsageError);
}

}  // namespace
}  // namespace surf::curve
