// What a surgery costs: two balls of 50,000 triangles each that overlap a little.
//
//   surgery_bench
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/surgery.h"

int main() {
  using namespace surf;
  using Clock = std::chrono::steady_clock;
  const double edge = 0.0242;
  const Triangles both =
      mesh::joined({mesh::ball({0, 0, 0}, 1, edge), mesh::ball({1.995, 0.003, 0.001}, 1, edge)});
  std::vector<double> detect, operate;
  mesh::SurgeryReport report;
  for (int run = 0; run < 7; ++run) {
    mesh::TriMesh mesh = mesh::to_mesh(both);
    mesh::mark_longest_edges(mesh);
    auto start = Clock::now();
    std::vector<char> events(both.elements.rows(), 0);
    for (const auto& [a, b] : mesh::self_intersections(both)) events[a] = events[b] = 1;
    detect.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    start = Clock::now();
    report = mesh::operate(mesh, events, {.resolution_mm = edge / 2});
    operate.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  std::sort(detect.begin(), detect.end());
  std::sort(operate.begin(), operate.end());
  for (const mesh::RebuiltRegion& region : report.regions)
    fmt::print("{} events, {} triangles removed ({:.2f} %), {} added{}\n", region.n_events,
               region.n_removed, 100.0 * region.n_removed / double(both.elements.rows()),
               region.n_added, region.is_whole ? ", whole components" : "");
  fmt::print("{} triangles: all intersections {:.1f} ms, surgery {:.1f} ms (medians of {})\n",
             both.elements.rows(), 1e3 * detect[3], 1e3 * operate[3], detect.size());
}
