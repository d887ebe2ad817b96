// Random evolutions of surfaces that merge, split and change genus, against a level set that is
// moved by the same field on a fine grid.
//
//   topology_fuzz [RUNS [FIRST [free|fixed|genus0]]]
//
// prints a line for each run that breaks a promise, and a summary; ends with 1 if there is one.
#include "tests/bench/topology_fuzz.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

int main(int argc, char** argv) {
  using namespace surf;
  using namespace surf::mesh::fuzz;
  openvdb::initialize();
  const int n_runs = argc > 1 ? std::atoi(argv[1]) : 20, first = argc > 2 ? std::atoi(argv[2]) : 0;
  const std::string name = argc > 3 ? argv[3] : "free";
  const mesh::Topology topology = name == "fixed"    ? mesh::Topology::kFixed
                                  : name == "genus0" ? mesh::Topology::kGenus0
                                                     : mesh::Topology::kFree;
  std::vector<double> differences;
  double most_left = 0, most_changed = 0;
  std::map<std::string, int> kinds;
  int n_bad = 0, n_vanished = 0;
  for (int seed = first; seed < first + n_runs; ++seed) {
    const auto start = std::chrono::steady_clock::now();
    try {
      const Outcome out = run(seed, topology);
      for (const auto& [kind, n] : out.kinds) kinds[kind] += n;
      n_vanished += out.has_vanished;
      most_left = std::max(most_left, out.left);
      most_changed = std::max(most_changed, out.surgery_change);
      if (out.difference > 0) differences.push_back(out.difference);
      const bool is_bad = !out.is_valid || !out.keeps_promise;
      n_bad += is_bad;
      if (is_bad || out.own_difference > 1 || argc > 4)
        fmt::print(
            "run {}: {}{}{} events {}, difference {:.2f} of area x resolution ({:.2f} of the "
            "surface's own area), {:.1f} s\n",
            seed, out.is_valid ? "" : "INVALID ", out.keeps_promise ? "" : "ANOTHER TOPOLOGY ",
            out.has_vanished ? "vanished" : "", out.n_events, out.difference, out.own_difference,
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    } catch (const std::exception& error) {
      ++n_bad;
      fmt::print("run {}: {}\n", seed, error.what());
    }
    std::fflush(stdout);
  }
  std::sort(differences.begin(), differences.end());
  fmt::print("{} runs, topology {}: {} broke a promise, {} vanished\n", n_runs, name, n_bad,
             n_vanished);
  if (!differences.empty())
    fmt::print(
        "difference to the level set, of area x resolution: median {:.3f}, 95 % {:.3f}, "
        "max {:.3f} ({} runs)\n",
        differences[differences.size() / 2], differences[differences.size() * 95 / 100],
        differences.back(), differences.size());
  fmt::print("largest change of volume by an event, of area x resolution: {:.3f}\n", most_changed);
  if (n_vanished > 0)
    fmt::print(
        "largest volume of the level set where the surface vanished: {:.4f} mm^3, {:.1f} cubes of "
        "the "
        "resolution\n",
        most_left, most_left / std::pow(kResolution, 3));
  for (const auto& [kind, n] : kinds) fmt::print("  {} {}\n", n, kind);
  return n_bad > 0;
}
