#include "tests/bench/synthetic_runs.h"

#include <fmt/format.h>

#include <numbers>
#include <utility>

#include "libcurve/image/image_fields.h"
#include "libcurve/image/phantom.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/primitives.h"

namespace surf::bench {
namespace {

/// The thesis does not print its profile, but its J at the end tell the steepest slope of I there,
/// about 3.6 / eps (Figs. 5.3 to 5.7); that of the phantoms is 2 / (sqrt(pi) eps). So theirs is an
/// image of this contrast; here it is 1, and lambda and the background are divided by it.
constexpr double kContrast = 3.2;
constexpr double kFound = 0.02;  // mean distance in units: half the edge of most cases
constexpr double kDepth = 0.51;  // of the concavity, as a chord leaves it

}  // namespace

std::vector<Experiment> experiments() {
  std::vector<Experiment> all;
  const auto add = [&](Experiment one) { all.push_back(std::move(one)); };
  const std::string edge = "edge width", strength = "edge strength", domain = "domain term",
                    linear = "linear background", waves = "waves";
  add({.section = edge,
       .name = "eps 0.01",
       .edge_width = 0.01,
       .L2 = {4360, 1.409, true},
       .H1 = {0, 0, true}});
  add({.section = edge,
       .name = "eps 0.01, lambda 400, adaptive",
       .edge_width = 0.01,
       .lambda = 400,
       .is_adaptive = true,
       .L2 = {16479, 1.993},
       .H1 = {4952, 2.072}});
  add({.section = edge,
       .name = "eps 0.025",
       .edge_width = 0.025,
       .L2 = {1026, 0.488},
       .H1 = {693, 0.509}});
  add({.section = edge, .name = "eps 0.05", .L2 = {361, 1.161}, .H1 = {298, 1.153}});
  add({.section = edge,
       .name = "eps 0.1",
       .edge_width = 0.1,
       .L2 = {3813, 1.949, true},
       .H1 = {0, 0, true}});
  add({.section = edge,
       .name = "eps 0.1, lambda 10",
       .edge_width = 0.1,
       .lambda = 10,
       .L2 = {280, 0.295},
       .H1 = {66, 0.291}});
  add({.section = strength,
       .name = "lambda 10",
       .lambda = 10,
       .L2 = {635, 0.167},
       .H1 = {118, 0.191}});
  add({.section = strength,
       .name = "lambda 25",
       .lambda = 25,
       .L2 = {245, 0.449},
       .H1 = {382, 0.467}});
  add({.section = strength,
       .name = "lambda 100",
       .lambda = 100,
       .L2 = {3216, 1.855, true},
       .H1 = {671, 2.475}});
  const double gammas[] = {0, 10, 20, 30};
  const Printed L2[] = {{272, 0.454}, {97, 8.819}, {179, 16.337}, {0, 0, true}};
  const Printed H1[] = {{203, 0.454}, {62, 8.877}, {129, 16.343}, {0, 0, true}};
  for (int i = 0; i < 4; ++i)
    add({.section = domain,
         .name = fmt::format("gamma {}", gammas[i]),
         .lambda = 25,
         .gamma = gammas[i],
         .n_nodes = 512,
         .tolerance_H1 = 5e-4,
         .L2 = L2[i],
         .H1 = H1[i]});
  add({.section = domain,
       .name = "gamma_0 0.2, gamma 6",
       .lambda = 25,
       .gamma0 = 0.2,
       .gamma = 6,
       .n_nodes = 512,
       .tolerance_H1 = 5e-4,
       .L2 = {0, 4.845},
       .H1 = {0, 4.851}});
  for (const double m : {0, 1, 10, 20})
    add({.section = linear,
         .name = fmt::format("m {}", m),
         .lambda = 25,
         .linear = m,
         .start_radius = 0.7,  // J_0 = 4.398 at m = 0, as printed
         .tolerance_L2 = 5e-4,
         .tolerance_H1 = 5e-4,
         .L2 = m == 0 ? Printed{42, 0.356} : Printed{},
         .H1 = m == 0 ? Printed{37, 0.353} : Printed{}});
  add({.section = waves,
       .name = "N 2, A 1",
       .lambda = 25,
       .amplitude = 1,
       .periods = 2,
       .tolerance_L2 = 5e-4,
       .tolerance_H1 = 5e-4,
       .L2 = {2500, 0.411, true},
       .H1 = {2900, 0.646, true}});
  add({.section = waves,
       .name = "N 2, A 0.3",
       .lambda = 25,
       .amplitude = 0.3,
       .periods = 2,
       .tolerance_L2 = 5e-4,
       .tolerance_H1 = 5e-4,
       .L2 = {101, 0.355},
       .H1 = {97, 0.341}});
  add({.section = waves,
       .name = "N 4, A 1",
       .lambda = 25,
       .amplitude = 1,
       .periods = 4,
       .tolerance_L2 = 5e-4,
       .tolerance_H1 = 5e-4,
       .L2 = {104, 0.346},
       .H1 = {90, 0.348}});
  return all;
}

SyntheticOutcome run(const Experiment& one, flow::ScalarProduct product, int n_pixels) {
  curve::PhantomOptions phantom;
  phantom.kind = curve::PhantomKind::kBay;
  phantom.size = {n_pixels, n_pixels};
  phantom.spacing_mm.setConstant(2.0 / (n_pixels - 1));
  phantom.edge_width = one.edge_width;
  phantom.linear_background = one.linear / kContrast;
  phantom.wave_amplitude = one.amplitude / kContrast;
  phantom.wave_periods = one.periods;
  const curve::Image image = curve::make_phantom(phantom);
  const auto H = curve::edge_indicator(image, {}, one.lambda / kContrast);
  Descent descent;
  descent.H = H;
  descent.gamma_0 = one.gamma0;
  descent.gamma = one.gamma;
  descent.product = product;
  descent.tolerance = product == flow::ScalarProduct::kL2 ? one.tolerance_L2 : one.tolerance_H1;
  descent.ray_spacing_mm = one.edge_width / 5;
  curve::MovingCurveOptions& options = descent.curves;
  options.edge_length_mm = 2 * std::numbers::pi / one.n_nodes;
  options.max_displacement_mm = 2 * one.edge_width;
  options.edge_indicator = H;  // no edge is jumped over
  options.path_spacing_mm = one.edge_width / 2;
  if (one.is_adaptive) {
    options.edge_length_mm = 2 * std::numbers::pi / 2048;
    options.coarseness = 64;
    options.adaptivity.geometry_tolerance_mm = 0.02;  // thesis 5.1
    options.adaptivity.integral_tolerance = 0.2 / (2 * std::numbers::pi);
    options.adaptivity.integrands = {H};
  }
  // One unit is 1 mm; pixel 0, 0 is at 0.
  const Vector<2> centre = phantom.unit_to_plane() * Vector<2>::Zero();
  const Segments start = curve::circle(centre, one.start_radius,
                                       2 * std::numbers::pi / (one.is_adaptive ? 32 : one.n_nodes));
  SyntheticOutcome out;
  out.end = descend(start, descent);
  const Segments outline = curve::phantom_contour(phantom);
  const curve::CurveDistances distances = curve::curve_distances(out.end.curves, outline);
  out.mean = distances.forward.mean_mm;
  out.max = distances.forward.max_mm;
  out.missed = distances.backward.max_mm;
  return out;
}

std::string found(const SyntheticOutcome& out) {
  if (out.mean > kFound || out.missed > kDepth + kFound) return "no";
  if (out.missed < 3 * kFound) return "all";
  return out.missed < kDepth / 2 ? "nearly all of the concavity" : "not the concavity";
}

}  // namespace surf::bench
