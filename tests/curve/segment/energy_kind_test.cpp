// The table of energy kinds, in images.
#include "libsurf/segment/energy_kind.h"

#include <gtest/gtest.h>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/segment/detail/curve_setting.h"
#include "libcurve/segment/segment.h"
#include "libsurf/base/error.h"
#include "tests/surf/segment/every_kind.h"

namespace surf::curve {
namespace {

using segment::EnergyTerm;

struct Scene {
  PhantomOptions phantom{.size = {64, 64}, .noise = 0.05};
  Image image = make_phantom(phantom);
  CurveSetting setting{image};
  std::unique_ptr<segment::EnergyModel<2>> model =
      setting.make_model({.smoothing = {.sigma_mm = image.pixel_size()}});
  segment::KindContext<2> context{
      .model = *model,
      .seeds_mm = {phantom.unit_to_plane() * Vector<2>(0, 0)},
      .seed = {.mean = 1, .deviation = 0.1, .noise = 0.05, .radius_mm = 5},
      .seed_radius_mm = 3};
};

TEST(EveryCurveKind, BuildsAndItsDerivativeIsTheDifferenceQuotient) {
  Scene scene;
  const Segments start = circle(scene.context.seeds_mm[0] + Vector<2>(0.3, -0.2), 14, 2);
  scene.context.initial = &start;  // for what is fitted to a shape
  scene.context.setting = &scene.setting;
  test::expect_derivatives_of_every_kind<2>(scene.context, start, 1e-4, 1e-3);
}

TEST(EveryCurveKind, RefusesWhatIsOutsideItsRanges) { test::expect_ranges_of_every_kind<2>(); }

TEST(EveryCurveKind, HasTheParametersOfThePlane) {
  EXPECT_EQ(segment::find_kind<2>("anisotropic").find_parameter("z"), nullptr);
  EXPECT_NE(segment::find_kind<2>("mumford-shah").find_parameter("data-tolerance"), nullptr);
  const Scene scene;
  CurveOptions options;
  options.seeds_mm = scene.context.seeds_mm;
  options.energies = {{"anisotropic", 1, {{"z", 2}}}};
  try {
    segment(scene.image, options);
    ADD_FAILURE() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "energy anisotropic: parameter 'z' is there for volumes only");
  }
}

TEST(EveryCurveKind, OfTheMumfordShahModelHasTheFirstPartOfAlgorithm17) {
  const Scene scene;
  const std::vector terms = segment::completed<2>(
      std::vector<EnergyTerm>{{"area", 1, {}}, {"mumford-shah", 1, {}}}, scene.context);
  EXPECT_FALSE(terms[1].parameters.contains("data-tolerance"));
  const auto coarse = segment::coarse_terms<2>(terms);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->at(0), terms[0]);
  EXPECT_EQ(coarse->at(1).parameters.at("data-tolerance"), 0);
  EXPECT_FALSE(segment::coarse_terms<2>(std::vector<EnergyTerm>{{"area", 1, {}}}));
}

// The window keeps the steps short, whichever comes first.
TEST(EveryCurveKind, GoesWithAWindowInAnyOrder) {
  const Scene scene;
  CurveOptions options;
  options.seeds_mm = scene.context.seeds_mm;
  const EnergyTerm window{"window", 1, {{"mean", 1}, {"half-width", 0.5}}};
  const EnergyTerm edges{"minimal-surface", 1, {{"gamma", 0}}};
  options.energies = {edges, window};
  const CurveResult first = segment(scene.image, options);
  options.energies = {window, edges};
  const CurveResult second = segment(scene.image, options);
  ASSERT_EQ(first.shape.points.rows(), second.shape.points.rows());
  EXPECT_LT((first.shape.points - second.shape.points).norm(), 1e-6);
}

}  // namespace
}  // namespace surf::curve
