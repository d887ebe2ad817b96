#include "libcurve/segment/segment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

double mean_distance(const Segments& curves, const PhantomOptions& phantom) {
  return curve_distances(curves, phantom_contour(phantom)).mean_mm;
}

// The contour of a scaled world, brought back, is the same but for rounding.
TEST(CurveSegment, DoesNotDependOnTheUnitOrTheIntensities) {
  PhantomOptions phantom{.size = {96, 96}, .noise = 0.05};
  const Image image = make_phantom(phantom);
  std::vector<float> mapped;
  for (const float value : image.values()) mapped.push_back(40 * value - 7);
  constexpr double kScale = 1e-3;
  const Image other(image.size(), pixel_to_plane({kScale, kScale}), mapped);
  CurveOptions options;
  options.seeds_mm = {{48, 48}};
  const Segments first = segment(image, options).shape;
  options.seeds_mm = {kScale * Vector<2>(48, 48)};
  Segments second = segment(other, options).shape;
  second.points /= kScale;
  EXPECT_LT(mean_distance(first, phantom), 0.25);
  // Pixels: floats of other sizes may end a run a step earlier.
  EXPECT_LT(curve_distances(first, second).mean_mm, 0.1);
}

TEST(CurveSegment, FindsTheNotchedObjectWithEveryFlow) {
  const PhantomOptions phantom{.kind = PhantomKind::kBay};
  const Image image = make_phantom(phantom);
  for (const auto product : {flow::ScalarProduct::kL2, flow::ScalarProduct::kH1}) {
    CurveOptions options;
    options.initial = circle({127.5, 127.5}, 120, 2);
    options.seeds_mm = {{90, 100}};
    options.energies = {{"chan-vese", 1, {}}, {"area", 0.5, {}}};
    options.flow.velocity.product = product;
    options.flow.velocity.scheme =
        product == flow::ScalarProduct::kL2 ? flow::Scheme::kSemiImplicit : flow::Scheme::kExplicit;
    const CurveResult result = segment(image, options);
    EXPECT_TRUE(verify(result.shape).passed());
    EXPECT_LT(mean_distance(result.shape, phantom), 0.5) << int(product);  // a cusp is cut short
  }
}

double psnr(const Image& image, const Image& clean) {
  double sum = 0;
  for (std::size_t i = 0; i < clean.n_pixels(); ++i)
    sum += std::pow(double(image.values()[i]) - clean.values()[i], 2);
  return -10 * std::log10(sum / double(clean.n_pixels()));
}

TEST(CurveSegment, MumfordShahFindsTheObjectInNoiseAndTakesTheNoiseAway) {
  PhantomOptions phantom{.size = {128, 128}, .noise = 0.25};
  const Image image = make_phantom(phantom);
  CurveOptions options;
  options.initial = circle({63.5, 63.5}, 55, 1.5);
  options.energies = {{"mumford-shah", 1, {}}};
  const CurveResult result = segment(image, options);
  EXPECT_TRUE(verify(result.shape).passed());
  EXPECT_EQ(verify(result.shape).n_components, 1);
  EXPECT_LT(mean_distance(result.shape, phantom), 0.5);
  EXPECT_EQ(result.stages.front().name, "coarse");
  EXPECT_EQ(result.stages.back().name, "evolve");
  const Image u = denoised(image, options, result);
  phantom.noise = 0;
  const Image clean = make_phantom(phantom);
  EXPECT_GT(psnr(u, clean), psnr(image, clean) + 8);
}

// Theorem 2.2.11 in use.
TEST(CurveSegment, NewtonEndsInTheMinimumOfTheH1FlowOfMumfordShah) {
  const PhantomOptions phantom{.size = {96, 96}, .noise = 0.1};
  const Image image = make_phantom(phantom);
  CurveOptions options;
  options.initial = circle({47.5, 47.5}, 32, 1.5);
  options.energies = {{"mumford-shah", 1, {}}};
  options.n_coarse_steps = 0;
  options.flow.rel_tol = 1e-6;
  options.flow.energy_tol = 0;
  const CurveResult by_h1 = segment(image, options);
  options.flow.method = flow::Method::kNewton;
  const CurveResult by_newton = segment(image, options);
  EXPECT_EQ(by_newton.last().termination, flow::Termination::kConverged);
  EXPECT_LE(by_newton.last().steps.size(), by_h1.last().steps.size());
  EXPECT_LT(curve_distances(by_newton.shape, by_h1.shape).mean_mm, 0.05);
  EXPECT_LT(mean_distance(by_newton.shape, phantom), 0.25);
}

TEST(CurveSegment, MumfordShahMergesSeedsAndDoesNotDependOnTheIntensities) {
  const PhantomOptions phantom{.size = {96, 96}, .noise = 0.05};
  const Image image = make_phantom(phantom);
  std::vector<float> mapped;
  for (const float value : image.values()) mapped.push_back(-40 * value - 7);
  CurveOptions options;
  options.initial = joined({circle({38, 48}, 8, 1.5), circle({58, 48}, 8, 1.5)});
  options.energies = {{"mumford-shah", 1, {{"mu", 400}, {"gamma", 0.25}}}};
  const Segments first = segment(image, options).shape;
  const Segments second =
      segment(Image(image.size(), image.pixel_to_plane(), mapped), options).shape;
  EXPECT_EQ(verify(first).n_components, 1);
  EXPECT_LT(mean_distance(first, phantom), 0.25);
  EXPECT_LT(curve_distances(first, second).mean_mm, 0.05);  // floats of other sizes
}

TEST(CurveSegment, DenoisedImageNeedsTheMumfordShahModel) {
  const Image image = make_phantom({.size = {48, 48}});
  CurveOptions options;
  options.initial = circle({24, 24}, 15, 1.5);
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.5, {}}};
  EXPECT_THROW(denoised(image, options, segment(image, options)), UsageError);
}

TEST(CurveSegment, OptionsAreChecked) {
  const Image image = make_phantom({.size = {32, 32}});
  CurveOptions options;
  EXPECT_THROW(segment(image, options), UsageError);
  options.seeds_mm = {{100, 3}};
  EXPECT_THROW(segment(image, options), UsageError);
  options.seeds_mm = {{16, 16}};
  options.topology = mesh::Topology::kGenus0;
  EXPECT_THROW(segment(image, options), UsageError);
  options.topology = mesh::Topology::kFree;
  options.components.min_content = -1;
  EXPECT_THROW(segment(image, options), UsageError);
}

TEST(RegionFilter, KeepsWhatItSays) {
  const Segments ring = joined({circle({0, 0}, 5, 0.5), flipped(circle({0, 0}, 2, 0.5)),
                                circle({20, 0}, 3, 0.5), circle({40, 0}, 1, 0.5)});
  int n_removed = 0;
  const auto n_left = [&](const RegionFilter& filter) {
    const auto [out, removed] = filtered(ring, filter);
    n_removed = 0;
    for (const RemovedRegion& part : removed) n_removed += part.n_curves;
    EXPECT_TRUE(verify(out).passed());
    return verify(out).n_components;
  };
  EXPECT_EQ(n_left({}), 4);
  EXPECT_EQ(n_removed, 0);
  RegionFilter filter;
  filter.fill_holes = true;
  EXPECT_EQ(n_left(filter), 3);
  filter = {};
  filter.min_area_mm2 = 10;
  EXPECT_EQ(n_left(filter), 3);
  filter.keep = mesh::Keep::kLargest;
  EXPECT_EQ(n_left(filter), 2);
  filter = {};
  filter.keep = mesh::Keep::kSeeded;
  EXPECT_THROW(n_left(filter), UsageError);
  filter.seeds_mm = {{20, 1}, {0, 0}};  // the second lies in the hole
  EXPECT_EQ(n_left(filter), 1);
  EXPECT_EQ(n_removed, 3);
}

}  // namespace
}  // namespace surf::curve
