// The synthetic study of thesis 5.1.1: edge width, edge strength, domain term and background, by
// the L2 and the H1 flow. The table of docs/synthetic-study.md.
//
//   synthetic_study [SET]   all sets, or the one of this name, such as "edge width"
#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "tests/bench/synthetic_runs.h"

namespace {

using namespace surf;
using namespace surf::bench;

std::string printed(const Printed& p) {
  if (p.k == 0 && p.J == 0) return p.is_missed ? "missed" : "-";
  std::string text = p.k > 0 ? fmt::format("{} / {}", p.k, p.J) : fmt::format("- / {}", p.J);
  return p.is_missed ? text + ", missed" : text;
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print(
      "| set | case | flow | thesis k / J | k | J_0 | J | nodes | mean / max distance | largest "
      "distance of the boundary | stop | found "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Experiment& one : experiments()) {
    if (argc > 1 && one.section != argv[1]) continue;
    for (const auto product : {flow::ScalarProduct::kL2, flow::ScalarProduct::kH1}) {
      const bool is_L2 = product == flow::ScalarProduct::kL2;
      const SyntheticOutcome out = run(one, product);
      fmt::print(
          "| {} | {} | {} | {} | {} | {:.3f} | {:.3f} | {} | {:.4f} / {:.3f} | {:.3f} | {} | {} "
          "|\n",
          one.section, one.name, is_L2 ? "L2" : "H1", printed(is_L2 ? one.L2 : one.H1),
          out.end.n_steps, out.end.J_first, out.end.J_last, out.end.curves.points.rows(), out.mean,
          out.max, out.missed, out.end.stop, found(out));
      std::fflush(stdout);
    }
  }
}
