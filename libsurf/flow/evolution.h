// The evolution loop: assemble, solve, choose step, move, mend, stop?
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/energy/shape_energy.h"
#include "libsurf/flow/moving_shape.h"
#include "libsurf/flow/step_control.h"
#include "libsurf/flow/velocity.h"

namespace surf::flow {

enum class Method {
  kGradientFlow,  ///< of VelocityOptions::product and scheme
  /// With the whole second derivative, within a trust region in the norm of the H1 product:
  /// Newton's step where that is positive definite and the step is short enough (trust_region.h).
  kNewton,
  /// L-BFGS of Ceres over normal displacements from the current shape, in rounds between which the
  /// mesh is mended. A step of the summary is a round.
  kLbfgs
};

struct FlowOptions {
  Method method = Method::kGradientFlow;
  VelocityOptions velocity;
  StepOptions step;
  /// The content is kept, by a multiplier and a correction of each step to rounding. So it is with
  /// the H^-1 product, in any case.
  bool keep_content = false;
  /// Content to keep [mm^Dim], to which the shape is moved first; none = that of the start.
  std::optional<double> content;
  int max_steps = 500;
  /// Converged when |dJ_k| <= rel_tol * max_j |dJ_j|: thesis (5.2) with |.|, relative to the
  /// steepest step so far, without its absolute tol, which would depend on the intensities' scale.
  double rel_tol = 1e-4;
  /// Converged when `energy_window` steps together gain at most energy_tol * (J_0 - J_k); 0 = when
  /// they gain nothing, where mending takes back what they do. Where J rises, by more than 5 % of
  /// that and 0.1 % of itself, it is no rest: the run goes on, and ends as rising if five windows
  /// together do.
  double energy_tol = 1e-3;
  int energy_window = 8;
  /// While each of these steps took a vertex as far as a step may, a part of the shape is still on
  /// its way: then they may gain no more than this share of energy_tol * (J_0 - J_k). In [0, 1]; 1
  /// = no difference.
  double energy_share_on_the_way = 0.1;
  /// Converged when no vertex moved further than this in any step of the window [mm]; 0 = off.
  double displacement_tol_mm = 0;
  /// Heard while the shape is brought to its content, before there are steps to tell of.
  std::stop_token stop;

  bool keeps_content() const {
    return keep_content || content ||
           (method == Method::kGradientFlow && velocity.product == ScalarProduct::kHMinus1);
  }
  std::string error() const;  ///< empty if valid
};

enum class Termination {
  kConverged,
  kMaxSteps,
  kStalled,  ///< no step decreases J
  kRising,   ///< mending adds more to J than the steps take from it
  kObstacle,
  kStopped
};
/// "converged", "max-steps", ...
std::string to_string(Termination termination);

/// One accepted step = a line of the log = a row of the table.
struct StepRecord {
  int k = 0;
  /// J after the step; after topology surgery, and of a part of a shape, up to a constant.
  double energy = 0;
  double tau = 0;
  double shape_derivative = 0;  ///< dJ(Gamma_k; V_k)
  double max_displacement_mm = 0;
  int n_trials = 0;
  double enclosed = 0;    ///< enclosed area [mm^2] or volume [mm^3]
  double multiplier = 0;  ///< of the content that is kept
  Eigen::Index n_vertices = 0, n_elements = 0;
  double held_share = 0;  ///< of the length or area: held back
  std::vector<TopologyEvent> events;
};

struct FlowSummary {
  Termination termination = Termination::kConverged;
  std::string message;  ///< one sentence for a person
  std::vector<StepRecord> steps;
  double initial_energy = 0, final_energy = 0;
};

/// Called after every step; false stops the run (the shape is then that of the last step).
using StepCallback = std::function<bool(const StepRecord&)>;

/// Descends J from the current shape. Each step is accepted only if J decreases.
/// @throws UsageError  options.error() is not empty
template <int Dim>
FlowSummary evolve(MovingShape<Dim>& shape, energy::ShapeEnergy<Dim>& energy,
                   const FlowOptions& options, const StepCallback& callback = {});

}  // namespace surf::flow
