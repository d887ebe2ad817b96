// The experiments of thesis 5.1.1: edge width, edge strength, domain term and background, by the L2
// and the H1 flow.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/descent.h"

namespace surf::bench {

/// What the thesis reports.
struct Printed {
  int k = 0;     ///< 0: not printed
  double J = 0;  ///< 0: not printed
  bool is_missed = false;
};

struct Experiment {
  std::string section, name;
  double edge_width = 0.05, lambda = 50, gamma0 = 1, gamma = 0;
  double linear = 0, amplitude = 0, periods = 2;
  double start_radius = 1;
  int n_nodes = 256;
  bool is_adaptive = false;
  double tolerance_L2 = 1e-4, tolerance_H1 = 1e-4;
  Printed L2, H1;
};

std::vector<Experiment> experiments();

struct SyntheticOutcome {
  Descended end;
  double mean = 0, max = 0;  ///< distance of the curve to the object's boundary
  double missed = 0;         ///< largest distance of the boundary to the curve: the concavity
};

/// On the phantom `bay`, on [-1, 1]^2 with one unit = 1 mm.
/// @param n_pixels  along each side; at 1024 a pixel is a fifth of the narrowest edge
SyntheticOutcome run(const Experiment& one, flow::ScalarProduct product, int n_pixels = 1024);

/// In words: "no", "not the concavity", "nearly all of the concavity", "all".
std::string found(const SyntheticOutcome& out);

}  // namespace surf::bench
