// Of the Mumford-Shah model in the plane the domain meshes, with and without the second half of
// Alg. 8, and the loop of Alg. 17, with and without its way back: tables of docs/mumford-shah.md.
// Lengths are in pixels.
//   multilevel_study [meshes|continuation]
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/image/image_fields.h"
#include "libcurve/image/phantom.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/moving_curve.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/segment/segment.h"
#include "libsurf/flow/evolution.h"

namespace {

using namespace surf;
using namespace surf::curve;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

constexpr int kSize = 256;
constexpr double kEdge = 1.5;

Points<2> pixel_box() {
  Points<2> out(4, 2);
  out << -1, -1, kSize, -1, kSize, kSize, -1, kSize;
  return out;
}

struct Case {
  std::string name;
  PhantomOptions phantom;
  Segments start;
  double texture = 0;  ///< amplitude of waves of 12 pixels in the middle of the image
};

Image image_of(const Case& one) {
  const Image image = make_phantom(one.phantom);
  std::vector<float> values = image.values();
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i) {
      const Vector<2> x(i - kSize / 2, j - kSize / 2);
      values[std::size_t(j) * kSize + i] +=
          float(one.texture * std::sin(x[0] / 2) * std::sin(x[1] / 2) *
                std::exp(-std::pow(x.norm() / 40, 4)));
    }
  return {image.size(), image.pixel_to_plane(), std::move(values)};
}

void run(const Case& one, double tolerance, double gamma_coarsen) {
  const Image image = image_of(one);
  MumfordShahOptions options;
  options.mu = 1000;
  options.gamma = 0.5;
  options.outer = pixel_box();
  options.data_tolerance = tolerance;
  options.gamma_coarsen = gamma_coarsen;
  FieldOptions fields;
  fields.smoothing.sigma_mm = 1;
  MumfordShah energy(intensity_field(image, fields), options);
  MovingCurveOptions curves;
  curves.edge_length_mm = kEdge;
  curves.coarseness = 4;
  curves.adaptivity.geometry_tolerance_mm = 1;
  curves.max_displacement_mm = 5;
  curves.box = {image.size(), image.pixel_to_plane(), image.plane_to_pixel()};
  MovingCurve shape(one.start, curves);
  flow::FlowOptions flow;
  double sum = 0;
  Eigen::Index most = 0, last = 0;
  const auto count = [&](const flow::StepRecord&) {
    last = energy.solution().mesh().triangles.rows();
    most = std::max(most, last);
    sum += double(last);
    return true;
  };
  const double start = now();
  const flow::FlowSummary out = flow::evolve<2>(shape, energy, flow, count);
  const double seconds = now() - start;
  const double area = double(kSize + 1) * (kSize + 1);
  const double error = energy.solution().integrals().errors.sum() / area;
  const double J = out.final_energy;
  fmt::print("| {} | {:g} | {:g} | {} | {:.0f} | {} | {} | {:.4f} | {:.5g} | {:.3f} | {:.1f} |\n",
             one.name, tolerance, gamma_coarsen, out.steps.size(), sum / double(out.steps.size()),
             most, last, error, J,
             curve_distances(shape.simplices(), phantom_contour(one.phantom)).mean_mm, seconds);
  std::fflush(stdout);
}

void print_meshes() {
  const Segments round_all = circle({127.5, 127.5}, 110, kEdge),
                 inside = circle({127.5, 127.5}, 40, kEdge);
  using enum PhantomKind;
  const std::vector<Case> cases = {{"blob", {.kind = kBlob, .noise = 0.1}, round_all},
                                   {"blob, waves", {.kind = kBlob, .noise = 0.1}, inside, 0.4},
                                   {"bay", {.kind = kBay, .noise = 0.1}, round_all},
                                   {"ring", {.kind = kRing, .noise = 0.1}, round_all}};
  fmt::print(
      "| image | epsilon_data | gamma_C | steps | triangles, mean | most | at the end | error | J "
      "| "
      "mean px | seconds |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Case& one : cases)
    for (const auto& [tolerance, gamma_coarsen] :
         {std::pair{0.05, 0.3}, {0.001, 0.0}, {0.001, 0.3}})
      run(one, tolerance, gamma_coarsen);
}

/// The loop of Alg. 17 as printed, and without its way back.
void print_continuation() {
  const Segments round_all = circle({127.5, 127.5}, 110, kEdge),
                 grid = grid_of_circles({0, 0}, {255, 255}, 24, 8, kEdge);
  fmt::print(
      "\n| image | noise | way back | steps | trials | returns | J | seconds |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, kind] : {std::pair{"blob", PhantomKind::kBlob},
                                   {"bay", PhantomKind::kBay},
                                   {"discs12", PhantomKind::kDiscs12}})
    for (const double noise : {0.1, 0.25, 0.5})
      for (const bool may_return : {false, true}) {
        CurveOptions options;
        options.initial = kind == PhantomKind::kDiscs12 ? grid : round_all;
        options.energies = {{"mumford-shah", 1, {{"mu", 1000}, {"gamma", 0.5}}}};
        options.continuation_returns = may_return;
        const double start = now();
        const CurveResult out =
            curve::segment(make_phantom({.kind = kind, .noise = noise}), options);
        const double seconds = now() - start;
        std::size_t n_steps = 0;
        int n_trials = 0, n_returns = 0;
        for (const auto& stage : out.stages) {
          n_steps += stage.flow.steps.size();
          for (const auto& step : stage.flow.steps) n_trials += step.n_trials;
          n_returns += stage.message.find("grown again") != std::string::npos;
        }
        fmt::print("| {} | {} | {} | {} | {} | {} | {:.6g} | {:.1f} |\n", name, noise,
                   may_return ? "yes" : "no", n_steps, n_trials, n_returns, out.last().final_energy,
                   seconds);
        std::fflush(stdout);
      }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "all";
  if (what == "meshes" || what == "all") print_meshes();
  if (what == "continuation" || what == "all") print_continuation();
}
