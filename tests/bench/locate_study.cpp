// Prints the table of docs/method.md on where edges are and how sure: distances to the exact
// surface before and after, and the share of the vertices within two of their stated deviations.
//
//   locate_study [ball|box|torus [SIZE]]
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/detail/locate_edges.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace {

using namespace surf;

struct Body {
  std::string name;
  volume::PhantomKind kind;
  Eigen::Vector3d seed_mm;
};

void run(const Body& body, int size, double noise) {
  volume::PhantomOptions phantom;
  phantom.kind = body.kind;
  phantom.noise = noise;
  phantom.size = {size, size, size};
  const volume::Volume image = volume::make_phantom(phantom);
  const double voxel = image.voxel_size();
  segment::SegmentOptions options;
  options.seeds_mm = {body.seed_mm};
  options.locate = false;
  const auto setting = segment::make_setting(image);
  const Triangles before = segment::segment<3>(setting, options).shape;
  // The deviation of the phantom's step is 0.36 of its half-width.
  const auto start = std::chrono::steady_clock::now();
  const auto located = segment::locate_edges<3>(*setting, before, 0.018);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Triangles after = setting->moved(before, located.points);
  const auto distance = [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  };
  const auto old = mesh::distances_from(before, distance),
             now = mesh::distances_from(after, distance);
  const Eigen::VectorXd& deviation = located.certainty.deviation_mm;
  double within = 0;
  for (Eigen::Index i = 0; i < deviation.size(); ++i)
    within += std::abs(distance(after.points.row(i))) <= 2 * deviation[i];
  const double cell = std::pow(voxel, 3);
  fmt::print(
      "| {} | {} | {} | {:.3f} / {:.3f} | {:.3f} / {:.3f} | {:.3f} | {:.1f} | {:.0f} +- {:.0f} | "
      "{:.0f} | {} | {:.2f} |\n",
      body.name, size, noise, old.mean_mm / voxel, old.p95_mm / voxel, now.mean_mm / voxel,
      now.p95_mm / voxel, deviation.mean() / voxel, 100 * within / double(deviation.size()),
      mesh::volume_mm3(after) / cell, located.certainty.content_deviation / cell,
      located.length_mm / voxel, mesh::verify(after).passed() ? "passed" : "FAILED", seconds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  using volume::PhantomKind;
  fmt::print(
      "| phantom | size | noise | before: mean / 95 % | after: mean / 95 % | deviation | within 2 "
      "deviations % | volume | L | verification | time s |\n|---|---|---|---|---|---|---|---|---|"
      "---|---|\n");
  for (const Body& body :
       {Body{"ball", PhantomKind::kBall, {0, 0, 0}}, Body{"box", PhantomKind::kBox, {0, 0, 0}},
        Body{"torus", PhantomKind::kTorus, {0.5, 0, 0}}})
    for (const int size : {64, 128}) {
      if (argc > 1 && body.name != argv[1]) continue;
      if (argc > 2 && std::to_string(size) != argv[2]) continue;
      for (const double noise : {0.05, 0.1, 0.2}) run(body, size, noise);
    }
}
