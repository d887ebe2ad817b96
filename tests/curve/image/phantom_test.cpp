#include "libcurve/image/phantom.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve {
namespace {

double area(const Segments& curves) {
  return fem::Geometry<2>(curves.points, curves.elements).enclosed();
}

TEST(CurvePhantom, OutlinesEncloseTheObjects) {
  constexpr double kChords = 1e-4;  // 720 to a turn take 4 / 720^2 of a circle's area
  // Half the integral of r^2 for the blob.
  EXPECT_NEAR(area(phantom_outline(PhantomKind::kBlob)), M_PI * 0.25 * (1 + 0.5 * 0.15 * 0.15),
              kChords);
  EXPECT_NEAR(area(phantom_outline(PhantomKind::kRing)), M_PI * (0.36 - 0.09), kChords);
  // The box -0.6..0.8 by -0.55..0.5 without its right part, two quarters and the bay.
  const double right_quarters = M_PI / 4 * (0.35 * 0.55 + 0.45 * 0.5);
  EXPECT_NEAR(area(phantom_outline(PhantomKind::kBay)),
              1.4 * 1.05 - right_quarters - M_PI / 2 * 0.2 * 0.6, kChords);
  double discs = 0;
  for (const double r : {.20, .13, .22, .16, .15, .24, .17, .21, .26, .18, .22, .12})
    discs += M_PI * r * r;
  EXPECT_NEAR(area(phantom_outline(PhantomKind::kDiscs12)), discs, kChords);
}

TEST(CurvePhantom, IsHalfOnItsContour) {
  for (const auto& [name, kind] : phantom_kinds()) {
    const PhantomOptions options{.kind = kind, .size = {128, 100}, .spacing_mm = {0.5, 0.5}};
    const Image image = make_phantom(options);
    const Segments contour = phantom_contour(options);
    EXPECT_GE(image.range()[0], 0) << name;
    EXPECT_LE(image.range()[1], 1) << name;
    for (Eigen::Index at = 0; at < contour.points.rows(); at += 37) {
      const Eigen::Vector2d mm = contour.points.row(at);
      const Eigen::Vector2d u = options.unit_to_plane().inverse() * mm;
      EXPECT_NEAR(phantom_depth(kind, phantom_outline(kind), u), 0, 1e-5) << name;
      EXPECT_TRUE(image.contains(mm)) << name;
    }
  }
}

TEST(CurvePhantom, BackgroundsAndNoiseAreAsTheySay) {
  PhantomOptions options{.size = {64, 64}};
  const Image plain = make_phantom(options);
  options.linear_background = 2;
  const Image linear = make_phantom(options);
  EXPECT_NEAR(linear.value(63, 63), 2, 1e-6);  // (m / 4) (2 + 1 + 1)
  EXPECT_NEAR(linear.value(0, 0), 0, 1e-6);
  EXPECT_NEAR(linear.value(32, 32), plain.value(32, 32), 1e-6);  // inside
  options = {.size = {64, 64}, .wave_amplitude = 0.3, .wave_periods = 4};
  EXPECT_NEAR(make_phantom(options).value(0, 5), 0.3 * std::cos(M_PI / 0.2), 1e-6);
  options = {.size = {64, 64}, .noise = 0.1, .random_seed = 7};
  EXPECT_EQ(make_phantom(options).values(), make_phantom(options).values());
  const Image noisy = make_phantom(options);
  double squares = 0;
  for (std::size_t at = 0; at < plain.n_pixels(); ++at)
    squares += std::pow(double(noisy.values()[at]) - plain.values()[at], 2);
  EXPECT_NEAR(std::sqrt(squares / double(plain.n_pixels())), 0.1, 0.005);  // 4 of its errors
}

TEST(CurvePhantom, OptionsAreChecked) {
  EXPECT_THROW(make_phantom({.size = {1, 5}}), UsageError);
  EXPECT_THROW(make_phantom({.edge_width = 0}), UsageError);
  EXPECT_THROW(make_phantom({.noise = NAN}), UsageError);
}

}  // namespace
}  // namespace surf::curve
