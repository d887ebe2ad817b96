// Random evolutions of curves that merge, split, open and cross themselves.
//
//   curve_fuzz [RUNS [FIRST [WORST]]]
//
// prints a line for each run that ends with invalid curves or differs from its reference by more
// than WORST (2) times length times topology resolution, and a summary.
#include "tests/bench/curve_fuzz.h"

#include <fmt/format.h>

#include <cstdlib>

namespace {

void print_distribution(const char* what, std::vector<double>& values) {
  if (values.empty()) return;
  std::sort(values.begin(), values.end());
  fmt::print("{} {}: median {:.3f}, 95 % {:.3f}, largest {:.3f} of length * resolution\n",
             values.size(), what, values[values.size() / 2], values[values.size() * 95 / 100],
             values.back());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace surf::curve::fuzz;
  const int n_runs = argc > 1 ? std::atoi(argv[1]) : 100, first = argc > 2 ? std::atoi(argv[2]) : 0;
  const double worst = argc > 3 ? std::atof(argv[3]) : 2;
  int n_invalid = 0, n_vanished = 0, n_steps = 0, n_taken_back = 0;
  std::map<std::string, int> kinds;
  std::vector<double> differences, changes;
  for (int seed = first; seed < first + n_runs; ++seed) {
    Outcome outcome;
    try {
      outcome = Evolution(seed).run();
    } catch (const std::exception& error) {
      outcome.is_valid = false;
      outcome.message = error.what();
    }
    n_invalid += !outcome.is_valid;
    n_vanished += outcome.has_vanished;
    n_steps += outcome.n_steps;
    n_taken_back += outcome.n_taken_back - int(outcome.has_vanished && outcome.n_taken_back > 0);
    for (const auto& [kind, n] : outcome.kinds) kinds[kind] += n;
    if (!outcome.kinds.empty()) changes.push_back(outcome.change);
    if (outcome.is_compared) differences.push_back(outcome.difference);
    if (!outcome.is_valid) fmt::print("run {}: {}\n", seed, outcome.message);
    if (outcome.difference > worst)
      fmt::print("run {}: differs by {:.2f}\n", seed, outcome.difference);
    std::fflush(stdout);
  }
  fmt::print("{} runs, {} steps: {} invalid, {} vanished, {} moves taken back\n", n_runs, n_steps,
             n_invalid, n_vanished, n_taken_back);
  for (const auto& [kind, n] : kinds) fmt::print("  {} {}\n", n, kind);
  print_distribution("compared with their references", differences);
  print_distribution("with events, the largest change by a mend", changes);
  return n_invalid > 0;
}
