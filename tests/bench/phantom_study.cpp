// Prints the tables of docs/phantoms.md: phantoms by start and flow, and by size of the volume,
// with the distance to the known surface and the final verification.
//   phantom_study            all of it
//   phantom_study sizes      by size alone
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/image_fields.h"
#include "libsurf/volume/phantom.h"

namespace {

using namespace surf;

struct Case {
  std::string name;
  volume::PhantomKind kind;
  double noise;
  bool from_seed;  // a ball of radius 0.15 inside, else a sphere of radius 1 outside
  bool automatic;  // no energy given
  int size = 128;
};

struct Flow {
  std::string name;
  flow::ScalarProduct product;
  flow::Scheme scheme;
};

struct Outcome {
  segment::SegmentResult result;
  mesh::DistanceStatistics distance;
  double voxel, seconds;
};

volume::PhantomOptions phantom_of(const Case& one) {
  volume::PhantomOptions out;
  out.kind = one.kind;
  out.noise = one.noise;
  out.size = {one.size, one.size, one.size};
  return out;
}

Outcome outcome(const Case& one, segment::SegmentOptions options) {
  const volume::PhantomOptions phantom = phantom_of(one);
  const volume::Volume image = volume::make_phantom(phantom);
  const auto start = std::chrono::steady_clock::now();
  Outcome out{segment::segment(image, options), {}, image.voxel_size(), 0};
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  out.distance = mesh::distances_from(out.result.shape, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  });
  return out;
}

std::string verdict_of(const Outcome& of) {
  const mesh::Verification check = mesh::verify(of.result.shape);
  return check.passed() ? fmt::format("passed, {} steps", of.result.n_steps()) : check.message();
}

void run(const Case& one, const Flow& flow) {
  segment::SegmentOptions options;
  if (one.from_seed) {
    const bool is_torus = one.kind == volume::PhantomKind::kTorus;
    const bool is_two = one.kind == volume::PhantomKind::kTwoBalls;
    options.seeds_mm = {Eigen::Vector3d(is_torus ? 0.5 : is_two ? 0.4 : 0, 0, 0)};
    if (!one.automatic) options.seed_radius_mm = 0.15;
  } else {
    options.initial = mesh::ball({0, 0, 0}, 1, 0.1);
  }
  if (!one.automatic) options.energies = {{"minimal-surface", 1, {}}};
  options.edge_length_mm = 3 * 2.0 / one.size;
  options.flow.velocity.product = flow.product;
  options.flow.velocity.scheme = flow.scheme;
  const Outcome of = outcome(one, options);
  fmt::print("| {} | {} | {} | {} | {} | {:.3f} / {:.3f} / {:.2f} | {} | {:.1f} | {} | {:.2f} |\n",
             one.name, one.noise > 0 ? "10 %" : "-", one.from_seed ? "seed" : "sphere r = 1",
             one.automatic ? "automatic" : "minimal surface", flow.name,
             of.distance.mean_mm / of.voxel, of.distance.p95_mm / of.voxel,
             of.distance.max_mm / of.voxel, of.result.shape.elements.rows(),
             mesh::verify(of.result.shape).min_angle_deg, verdict_of(of), of.seconds);
  std::fflush(stdout);
}

/// Nothing given but the seed, and by minimal-surface with its defaults.
void run_size(const Case& one) {
  segment::SegmentOptions options;
  options.seeds_mm = {Eigen::Vector3d::Zero()};
  if (!one.automatic) options.energies = {{"minimal-surface", 1, {}}};
  const Outcome of = outcome(one, options);
  fmt::print("| {} | {:.2g} | {} | {} | {:.3f} / {:.3f} / {:.2f} | {} | {} | {} | {:.2f} |\n",
             one.name, one.noise, one.size, one.automatic ? "seed alone" : "minimal-surface",
             of.distance.mean_mm / of.voxel, of.distance.p95_mm / of.voxel,
             of.distance.max_mm / of.voxel, of.result.shape.elements.rows(), verdict_of(of),
             segment::to_string(of.result.outcome), of.seconds);
  std::fflush(stdout);
}

void run_sizes() {
  using volume::PhantomKind;
  fmt::print(
      "\n| phantom | noise | size | energy | distance mean / 95 % / max voxel | triangles | "
      "verification | outcome | time s |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const bool automatic : {true, false}) {
    for (const int size : {64, 128, 256}) {
      run_size({"ball", PhantomKind::kBall, 0, true, automatic, size});
      run_size({"ball", PhantomKind::kBall, 0.1, true, automatic, size});
      run_size({"box", PhantomKind::kBox, 0, true, automatic, size});
    }
    run_size({"ball", PhantomKind::kBall, 0.05, true, automatic, 512});
  }
}

/// Radius of the ball that minimises int H dS among balls: the least of r^2 times the mean of H
/// on the sphere, with the field that the run sees.
double minimising_radius(const volume::Volume& image, double sigma_mm, double lambda) {
  const auto H = volume::edge_indicator(image, {.sigma_mm = sigma_mm}, lambda);
  const Points<3> directions = segment::directions<3>(4000);
  Samples<3> samples;
  double best = 0, least = 1e300;
  for (double r = 0.58; r < 0.62; r += 1e-5) {
    H->sample(r * directions, Derivatives::kNone, samples);
    const double J = r * r * samples.value.mean();
    if (J < least) {
      least = J;
      best = r;
    }
  }
  return best;
}

/// The ball without the last stage: what (5.1) itself gives, against its own minimiser and the
/// edge.
void compare_with_minimiser() {
  volume::PhantomOptions phantom;
  const volume::Volume image = volume::make_phantom(phantom);
  segment::SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 1, 0.1);
  options.energies = {{"minimal-surface", 1, {}}};
  options.edge_length_mm = 3 * image.voxel_size();
  options.flow.rel_tol = 1e-7;
  options.settle = false;
  const segment::SegmentResult result = segment::segment(image, options);
  const double lambda = result.energies.front().parameters.at("lambda");
  const double radius = minimising_radius(image, result.sigma_mm, lambda);
  const auto to = [&](double r) {
    return mesh::distances_from(result.shape, [r](const Vector<3>& x) { return x.norm() - r; });
  };
  const double voxel = image.voxel_size();
  fmt::print(
      "\nBall without the settle stage (H1, gamma = 0, lambda = {:.3g}, sigma = {:.2g} voxel): the "
      "minimising ball of int H dS lies {:.3f} voxel inside the edge; the surface lies {:.3f} "
      "voxel (mean) from that ball and {:.3f} voxel from the edge.\n",
      lambda, result.sigma_mm / voxel, (0.6 - radius) / voxel, to(radius).mean_mm / voxel,
      to(0.6).mean_mm / voxel);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "sizes") {
    run_sizes();
    return 0;
  }
  using volume::PhantomKind;
  const std::vector<Flow> flows = {
      {"H1 explicit", flow::ScalarProduct::kH1, flow::Scheme::kExplicit},
      {"H1 semi-implicit", flow::ScalarProduct::kH1, flow::Scheme::kSemiImplicit},
      {"L2 semi-implicit", flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit}};
  fmt::print(
      "| phantom | noise | start | energy | flow | distance mean / 95 % / max voxel | triangles | "
      "min angle | verification | time s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Case& one : {Case{"ball", PhantomKind::kBall, 0, false, false},
                          Case{"ball", PhantomKind::kBall, 0, true, false},
                          Case{"ball", PhantomKind::kBall, 0.1, false, false},
                          Case{"ball", PhantomKind::kBall, 0.1, true, false},
                          Case{"box", PhantomKind::kBox, 0, false, false},
                          Case{"box", PhantomKind::kBox, 0, true, false},
                          Case{"two-balls", PhantomKind::kTwoBalls, 0, false, false}})
    for (const Flow& flow : flows) run(one, flow);
  for (const Case& one : {Case{"ball", PhantomKind::kBall, 0, true, true},
                          Case{"ball", PhantomKind::kBall, 0.1, true, true},
                          Case{"box", PhantomKind::kBox, 0, true, true}})
    run(one, flows.front());
  run_sizes();
  compare_with_minimiser();
}
