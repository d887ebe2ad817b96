#include "libsurf/flow/step_control.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace surf::flow {

std::string StepOptions::error() const {
  if (!(0 < alpha && alpha < beta && beta < 1))
    return fmt::format("StepOptions::alpha = {}, beta = {} violate 0 < alpha < beta < 1", alpha,
                       beta);
  if (!(epsilon_tau > 0 && std::isfinite(epsilon_tau)))
    return fmt::format("StepOptions::epsilon_tau = {} violates > 0", epsilon_tau);
  if (!(exempt_share >= 0 && exempt_share < 1))
    return fmt::format("StepOptions::exempt_share = {} violates 0 <= exempt_share < 1",
                       exempt_share);
  if (!(tau > 0)) return fmt::format("StepOptions::tau = {} violates > 0", tau);
  if (!(tau_min >= 0 && std::isfinite(tau_min)))
    return fmt::format("StepOptions::tau_min = {} violates >= 0", tau_min);
  if (tau_max && !(*tau_max > 0 && *tau_max >= tau_min))
    return fmt::format("StepOptions::tau_max = {} violates > 0 and >= tau_min = {}", *tau_max,
                       tau_min);
  if (max_trials < 1) return fmt::format("StepOptions::max_trials = {} violates >= 1", max_trials);
  return {};
}

std::optional<Step> choose_step(const StepOptions& options, double tau_first, double tau_max,
                                const std::function<Trial(double)>& attempt) {
  double tau = tau_first;
  double too_small = 0, too_large = tau_max;
  bool bounded_above = false;  // a trial with too little decrease was seen
  std::optional<Step> fallback;
  Step step;
  if (options.rule == StepRule::kFixed) {
    step.tau = std::min(options.tau, tau_max);
    for (step.n_trials = 1; step.n_trials <= options.max_trials; ++step.n_trials) {
      if (step.tau < options.tau_min) break;
      step.trial = attempt(step.tau);
      if (std::isfinite(step.trial.change)) return step;
      step.tau /= 2;  // there is no such shape
    }
    return std::nullopt;
  }
  for (step.n_trials = 1; step.n_trials <= options.max_trials; ++step.n_trials) {
    if (tau < options.tau_min) break;
    step.tau = tau;
    step.trial = attempt(tau);
    const bool decreases = step.trial.change < 0;
    if (options.rule == StepRule::kBacktracking) {
      if (decreases) return step;
      tau /= 2;
      continue;
    }
    const bool enough = step.trial.change <= options.alpha * step.trial.expected;
    const bool too_much = step.trial.change < options.beta * step.trial.expected;
    if (decreases && enough && (!too_much || tau >= tau_max)) return step;
    if (decreases && enough) {  // too much decrease: the step may grow
      fallback = step;
      too_small = tau;
      tau = bounded_above ? (too_small + too_large) / 2 : std::min(2 * tau, tau_max);
      if (bounded_above && too_large < 1.2 * too_small) return step;
    } else {
      bounded_above = true;
      too_large = tau;
      tau = too_small > 0 ? (too_small + too_large) / 2 : tau / 2;
    }
  }
  if (!fallback) return std::nullopt;
  if (fallback->tau != step.tau) attempt(fallback->tau);  // so that it is the last one tried
  fallback->n_trials = step.n_trials;
  return fallback;
}

template <int Dim>
double max_velocity_gradient(const fem::Geometry<Dim>& shape, const Points<Dim>& velocity,
                             double exempt_share) {
  std::vector<std::pair<double, double>> of_elements(
      std::size_t(shape.n_elements()));  // gradient and measure
  tbb::parallel_for(Eigen::Index(0), shape.n_elements(), [&](Eigen::Index t) {
    Eigen::Matrix<double, Dim, Dim> gradient = Eigen::Matrix<double, Dim, Dim>::Zero();
    for (int i = 0; i < Dim; ++i)
      gradient +=
          velocity.row(shape.elements()(t, i)).transpose() * shape.basis_gradients(t).row(i);
    of_elements[std::size_t(t)] = {gradient.norm(), shape.measures()[t]};
  });
  // From the steepest on, of which few are looked at.
  std::make_heap(of_elements.begin(), of_elements.end());
  double left = exempt_share * shape.measure();
  for (auto end = of_elements.end(); end != of_elements.begin(); --end) {
    const auto [gradient, measure] = of_elements.front();
    if ((left -= measure) < 0) return gradient;
    std::pop_heap(of_elements.begin(), end);
  }
  return 0;
}

template double max_velocity_gradient<2>(const fem::Geometry<2>&, const Points<2>&, double);
template double max_velocity_gradient<3>(const fem::Geometry<3>&, const Points<3>&, double);

}  // namespace surf::flow
