// Descents of the minimal surface model (5.1) in the plane, as thesis 5.1 runs them: L2
// semi-implicit or H1 explicit, until |dJ| falls below an absolute tolerance.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "libcurve/mesh/moving_curve.h"
#include "libsurf/flow/evolution.h"

namespace surf::bench {

struct Descent {
  std::shared_ptr<const Field<2>> H;
  double gamma_0 = 1, gamma = 0;
  flow::ScalarProduct product = flow::ScalarProduct::kH1;
  double beta_floor = 100;  ///< of the H1 product: flow::VelocityOptions
  double tolerance = 1e-4;  ///< tol of (5.2), where tol_rel = 0
  int max_steps = 3000;
  double ray_spacing_mm = 1;  ///< of int H dx at the start and at the end
  curve::MovingCurveOptions curves = {};
};

struct Descended {
  Segments curves;
  int n_steps = 0, n_trials = 0;
  double seconds = 0;
  double J_first = 0, J_last = 0;  ///< both from scratch, after whatever surgery
  std::string stop;                ///< "converged", "max-steps", ...
};

using EachStep = std::function<void(const flow::StepRecord&, const Segments&)>;

Descended descend(const Segments& start, const Descent& descent, const EachStep& each_step = {});

}  // namespace surf::bench
