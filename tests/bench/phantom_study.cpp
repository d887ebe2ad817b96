// Prints the table of docs/phantoms.md: every phantom, start and flow, with the distance to
// the known surface and the final verification.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <string>
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
};

struct Flow {
  std::string name;
  flow::ScalarProduct product;
  flow::Scheme scheme;
};

constexpr int kSize = 128;

void run(const Case& one, const Flow& flow) {
  volume::PhantomOptions phantom;
  phantom.kind = one.kind;
  phantom.noise = one.noise;
  phantom.size = {kSize, kSize, kSize};
  const volume::Volume image = volume::make_phantom(phantom);
  const double voxel = image.voxel_size();

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
  options.edge_length_mm = 3 * voxel;
  options.flow.velocity.product = flow.product;
  options.flow.velocity.scheme = flow.scheme;

  const auto start = std::chrono::steady_clock::now();
  const segment::SegmentResult result = segment::segment(image, options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto distance = mesh::distances_from(result.shape, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  });
  const mesh::Verification check = mesh::verify(result.shape);
  int steps = 0;
  for (const auto& stage : result.stages) steps += static_cast<int>(stage.flow.steps.size());
  fmt::print("| {} | {} | {} | {} | {} | {:.3f} / {:.3f} / {:.2f} | {} | {:.1f} | {} | {:.2f} |\n",
             one.name, one.noise > 0 ? "10 %" : "-", one.from_seed ? "seed" : "sphere r = 1",
             one.automatic ? "automatic" : "minimal surface", flow.name, distance.mean_mm / voxel,
             distance.p95_mm / voxel, distance.max_mm / voxel, result.shape.elements.rows(),
             check.min_angle_deg,
             check.passed() ? fmt::format("passed, {} steps", steps) : check.message(), seconds);
  std::fflush(stdout);
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

int main() {
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
  compare_with_minimiser();
}
