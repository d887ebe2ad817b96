// Phantoms whose surfaces have to merge, split or change genus on the way: the table of
// docs/topology.md.
//
//   topology_study [DIRECTORY [NAME]]
//
// writes the surfaces (.vtp) and pictures (.png, with a display) into the directory; with a name,
// only phantoms that have it in "phantom, start".
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"
#include "tests/bench/draw_surface.h"

namespace {

using namespace surf;
using volume::PhantomKind;

const io::RenderOptions kPicture = {.width = 800, .height = 800};
constexpr int kSize = 128;

struct Expected {
  int components, cavities, genus;
};

struct Case {
  std::string name, start;
  PhantomKind kind;
  Expected expected;
  segment::SegmentOptions options;
  double edge_voxels = 0;  ///< half-width of the image's edges; 0 = the phantom's own
};

segment::SegmentOptions grown(const std::vector<Eigen::Vector3d>& seeds, double radius,
                              std::vector<segment::EnergyTerm> energies) {
  segment::SegmentOptions options;
  options.seeds_mm = seeds;
  options.seed_radius_mm = radius;
  options.energies = std::move(energies);
  return options;
}

segment::SegmentOptions shrunk(double radius, std::vector<segment::EnergyTerm> energies) {
  segment::SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, radius, 0.05);
  options.energies = std::move(energies);
  return options;
}

std::vector<Case> cases() {
  const std::vector<segment::EnergyTerm> balloon = {{"minimal-surface", 1, {}}};
  const std::vector<segment::EnergyTerm> edges = {{"minimal-surface", 1, {{"gamma", 0}}}};
  const std::vector<segment::EnergyTerm> regions = {{"chan-vese", 1, {}}};
  std::vector<Case> all = {
      {"ball",
       "three seeds",
       PhantomKind::kBall,
       {1, 0, 0},
       grown({{0.3, 0, 0}, {-0.25, 0.2, 0}, {0, -0.1, 0.3}}, 0.1, balloon)},
      {"torus", "one seed", PhantomKind::kTorus, {1, 0, 1}, grown({{0.5, 0, 0}}, 0.1, balloon)},
      {"torus",
       "three seeds",
       PhantomKind::kTorus,
       {1, 0, 1},
       grown({{0.5, 0, 0}, {-0.25, 0.43, 0}, {-0.25, -0.43, 0}}, 0.1, balloon)},
      {"shell",
       "a seed in the wall",
       PhantomKind::kShell,
       {1, 1, 0},
       grown({{0.45, 0, 0}}, 0.1, balloon)},
      {"shell",
       "enclosing sphere, chan-vese",
       PhantomKind::kShell,
       {1, 1, 0},
       shrunk(0.9, regions)},
      {"separate-balls",
       "enclosing sphere",
       PhantomKind::kSeparateBalls,
       {2, 0, 0},
       shrunk(0.95, edges)},
      {"tree", "one seed", PhantomKind::kTree, {1, 0, 0}, grown({{0, 0, -0.6}}, 0.06, balloon)},
      {"rods",
       "one seed, filled",
       PhantomKind::kRods,
       {1, 0, 0},
       grown({{0, 0.05, 0.05}}, 0.1, balloon),
       1},
      {"rods",
       "enclosing sphere, chan-vese, not filled",
       PhantomKind::kRods,
       {1, 0, 40},
       shrunk(0.64, {{"chan-vese", 1, {}}, {"area", 0.003, {}}}),
       1}};
  all[4].options.open_cavities = true;
  const double voxel = 2.0 / (kSize - 1);
  for (Case& one : all)
    if (one.expected.genus == 40) {  // their radius is 1.4 voxels
      one.options.sigma_mm = 0.3 * voxel;
      one.options.edge_length_mm = voxel;
      one.options.topology_resolution_mm = 0.5 * voxel;
      one.options.flow.energy_tol = 1e-4;  // the last membrane weighs little
      one.options.settle = false;
    }
  return all;
}

void run(const Case& one, const std::filesystem::path& directory) {
  volume::PhantomOptions phantom;
  phantom.kind = one.kind;
  phantom.size = {kSize, kSize, kSize};
  const double voxel = 2.0 / (kSize - 1);
  if (one.edge_voxels > 0) phantom.edge_width_mm = one.edge_voxels * voxel;
  const volume::Volume image = volume::make_phantom(phantom);
  const auto start = std::chrono::steady_clock::now();
  const auto result = segment::segment(image, one.options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const mesh::ShellHierarchy hierarchy = mesh::shell_hierarchy(result.shape);
  Expected found{0, 0, 0};
  for (const mesh::Solid& solid : mesh::solids(hierarchy)) {
    ++found.components;
    found.cavities += int(solid.cavities.size());
  }
  for (const mesh::Shell& shell : hierarchy.shells) found.genus += shell.genus;
  std::map<std::string, int> kinds;
  std::size_t n_steps = 0;
  for (const auto& stage : result.stages) {
    n_steps += stage.flow.steps.size();
    for (const auto& step : stage.flow.steps)
      for (const auto& event : step.events) ++kinds[to_string(event.kind)];
  }
  std::string events;
  for (const auto& [kind, n] : kinds)
    events += fmt::format("{}{} {}", events.empty() ? "" : ", ", n, kind);
  const auto distance = mesh::distances_from(result.shape, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  });
  const bool is_right = found.components == one.expected.components &&
                        found.cavities == one.expected.cavities &&
                        found.genus == one.expected.genus;
  fmt::print(
      "| {} | {} | {} / {} / {} | {} / {} / {}{} | {:.3f} / {:.2f} | {} | {} | {} | {:.1f} |\n",
      one.name, one.start, one.expected.components, one.expected.cavities, one.expected.genus,
      found.components, found.cavities, found.genus, is_right ? "" : " **WRONG**",
      distance.mean_mm / voxel, distance.max_mm / voxel,
      mesh::verify(result.shape).passed() ? "passed" : "FAILED", events, n_steps, seconds);
  std::fflush(stdout);
  std::string name = one.name + "-" + one.start;
  for (char& c : name)
    if (c == ' ' || c == ',') c = '-';
  bench::draw(directory, name, result.shape, kPicture);
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path directory = argc > 1 ? argv[1] : "";
  if (!directory.empty()) std::filesystem::create_directories(directory);
  fmt::print(
      "| phantom | start | components / cavities / handles | found | mean / max distance voxel | "
      "verification | events | steps | time s |\n|---|---|---|---|---|---|---|---|---|\n");
  const std::string name = argc > 2 ? argv[2] : "";
  for (const Case& one : cases())
    if ((one.name + ", " + one.start).find(name) != std::string::npos) run(one, directory);
}
