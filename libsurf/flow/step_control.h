// Choosing the time step: backtracking (Alg. 1), line search (Alg. 2), time step control
// (Alg. 3).
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "libsurf/fem/geometry.h"

namespace surf::flow {

enum class StepRule {
  kBacktracking,
  kLineSearch,
  kFixed  ///< StepOptions::tau within the bounds, whatever J does: thesis Alg. 17, far from optima
};

/// What keeps a step within the displacement that a shape allows its vertices.
enum class StepBound {
  kShape,  ///< the whole step is shortened until its fastest vertex obeys
  /// Each vertex that would go further goes as far as it may, the others move on, up to the step 1
  /// of an inexact Newton method: where most of a shape is nearly at its minimum, a few vertices on
  /// a long way hold up no others. For gradient flows.
  kVertex
};

struct StepOptions {
  StepRule rule = StepRule::kLineSearch;
  StepBound bound = StepBound::kShape;
  /// Line search accepts beta * expected <= actual <= alpha * expected, both changes negative
  /// (thesis (3.37), signs corrected); 0 < alpha < beta < 1.
  double alpha = 0.25, beta = 0.75;  // thesis 5.1
  /// Time step control: tau |grad_Gamma V| <= epsilon_tau.
  double epsilon_tau = 0.8;  // thesis 5.1
  /// Elements with this share of the length or area may have a larger gradient: as printed (0), a
  /// single poor triangle in a groove between two fronts makes steps 500 times shorter. Those that
  /// would turn over are held back by the moving shape. In [0, 1).
  double exempt_share = 1e-4;
  int max_trials = 12;
  double tau = 1;  ///< of kFixed: the whole step of an inexact Newton method
  /// Of all gradient flows: no longer step is taken, and no shorter one tried; where those that are
  /// left do not lower J, or would go further than the shape allows, the flow has come to a limit
  /// (Termination::kMaxSteps). The thesis' Alg. 3 would take tau_min against its own bound.
  /// 0 <= tau_min <= tau_max.
  double tau_min = 0;
  std::optional<double> tau_max = {};  ///< none = no bound

  std::string error() const;  ///< empty if valid
};

/// What is known of one tried step.
struct Trial {
  double change = 0;    ///< J(new) - J(old)
  double expected = 0;  ///< tau dJ(V)
};

struct Step {
  double tau = 0;
  Trial trial;
  int n_trials = 0;
};

/// Alg. 1 and 2. `attempt(tau)` moves a copy of the shape and returns the change of J.
/// Too little decrease shrinks the step, too much grows it (Alg. 2 as printed has the two
/// mixed up). A step at tau_max is accepted however much it gains.
/// kFixed takes the lesser of tau and tau_max, or the first half of it at which there is a J. None
/// that is shorter than options.tau_min is attempted.
/// @param tau_first  first trial, 0 < tau_first <= tau_max
/// @return the accepted step, which is the last one attempted; nothing if no trial decreased J
std::optional<Step> choose_step(const StepOptions& options, double tau_first, double tau_max,
                                const std::function<Trial(double)>& attempt);

/// Largest |grad_Gamma V| over the elements, of the vector velocity (n, Dim), but for those with
/// the largest ones that make up no more than a share of the length or area: Alg. 3.
template <int Dim>
double max_velocity_gradient(const fem::Geometry<Dim>& shape, const Points<Dim>& velocity,
                             double exempt_share = 0);

}  // namespace surf::flow
