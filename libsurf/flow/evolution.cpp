#include "libsurf/flow/evolution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libsurf/base/error.h"
#include "libsurf/fem/stiffness.h"

namespace surf::flow {
namespace {

constexpr double kAtBound = 0.9;  // of the largest displacement
constexpr double kAtRest = 0.1;   // likewise: the fastest vertex hardly moves

/// Has the run come to rest?
class StoppingRule {
 public:
  explicit StoppingRule(const FlowOptions& options) : options_(options) {}

  /// The sentence that says why, else empty.
  /// @param bound_mm  on the displacement of a vertex in a step
  std::string check(const FlowSummary& summary, double bound_mm) {
    const StepRecord& last = summary.steps.back();
    steepest_ = std::max(steepest_, std::abs(last.shape_derivative));
    // A dent of few vertices, where fronts met last, adds little to dJ.
    if (std::abs(last.shape_derivative) <= options_.rel_tol * steepest_ &&
        last.max_displacement_mm <= kAtRest * bound_mm)
      return fmt::format("the shape derivative fell to {:.1e} of its largest value",
                         std::abs(last.shape_derivative) / steepest_);
    n_at_bound_ = last.max_displacement_mm > kAtBound * bound_mm ? n_at_bound_ + 1 : 0;
    const int window = options_.energy_window;
    const int n = static_cast<int>(summary.steps.size());
    if (n <= window) return {};
    const double gained = summary.steps[n - 1 - window].energy - last.energy;
    const double total = summary.initial_energy - last.energy;
    const double share = n_at_bound_ >= window ? options_.energy_share_on_the_way : 1;
    if (gained <= share * options_.energy_tol * total)
      return fmt::format("the last {} steps gained {:.1e} of the whole decrease", window,
                         gained / total);
    double furthest = 0;
    for (int k = n - window; k < n; ++k)
      furthest = std::max(furthest, summary.steps[k].max_displacement_mm);
    if (furthest <= options_.displacement_tol_mm)
      return fmt::format("no vertex moved further than {:.2g} mm in the last {} steps", furthest,
                         window);
    return {};
  }

 private:
  const FlowOptions& options_;
  double steepest_ = 0;
  int n_at_bound_ = 0;  // steps up to the last one whose displacement was about the largest
};

/// One step: the velocity system at the current shape, and the search along it.
template <int Dim>
class Stepper {
 public:
  Stepper(MovingShape<Dim>& shape, energy::ShapeEnergy<Dim>& energy, const FlowOptions& options)
      : moving_(shape), energy_(energy), options_(options) {}

  /// Fills the record; false if no step decreases J.
  bool advance(const fem::Geometry<Dim>& shape, StepRecord& record) {
    const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
    energy::ShapeTerms<Dim> terms(shape);
    energy_.differentiate(fem::curvature<Dim>(shape, A), 1, terms);
    const VelocitySystem<Dim> system(shape, terms, A, options_.velocity);
    velocity_ = system.solve(previous_tau_);
    const double tau_max = largest_step(shape);
    if (!(tau_max > 0)) return false;
    const double J = energy_.value();
    const auto attempt = [&](double tau) {
      if (system.depends_on_step()) velocity_ = system.solve(tau);
      to_ = shape.points() + tau * velocity_.vector;
      record.held_share = moving_.restrict_move(to_);
      const Points<Dim> moved = to_ - shape.points();
      const double expected = terms.derivative.cwiseProduct(moved).sum();
      return Trial{try_points(shape) - J, expected};
    };
    const auto step = choose_step(options_.step, first_trial(tau_max), tau_max, attempt);
    record.shape_derivative = velocity_.shape_derivative;
    if (!step) return false;
    previous_tau_ = step->tau;
    energy_.accept();
    record.tau = step->tau;
    record.energy = energy_.value();
    record.n_trials = step->n_trials;
    record.max_displacement_mm = (to_ - shape.points()).rowwise().norm().maxCoeff();
    return true;
  }

  const Points<Dim>& destination() const { return to_; }

 private:
  /// J at the tried points; infinite where the tried shape has an element without measure.
  double try_points(const fem::Geometry<Dim>& shape) {
    try {
      return energy_.try_move(shape.moved_to(to_));
    } catch (const InvalidMesh&) {
      return std::numeric_limits<double>::infinity();
    }
  }

  /// Bound by the largest displacement and by Alg. 3.
  double largest_step(const fem::Geometry<Dim>& shape) const {
    const double speed = velocity_.vector.rowwise().norm().maxCoeff();
    if (!(speed > 0) || !std::isfinite(speed)) return 0;
    double tau = std::min(moving_.max_displacement(), shape.radius()) / speed;
    const double gradient =
        max_velocity_gradient<Dim>(shape, velocity_.vector, options_.step.exempt_share);
    if (gradient > 0) tau = std::min(tau, options_.step.epsilon_tau / gradient);
    return tau;
  }

  /// Twice the last step, but for H1 the full inexact Newton step 1 first: longer ones are only
  /// found by the line search, where J falls as fast as a linear function.
  double first_trial(double tau_max) const {
    const bool is_newton = options_.velocity.product == ScalarProduct::kH1;
    double tau = previous_tau_ > 0 ? 2 * previous_tau_ : is_newton ? 1 : tau_max;
    if (is_newton) tau = std::min(tau, std::max(1.0, previous_tau_));
    return std::min(tau, tau_max);
  }

  MovingShape<Dim>& moving_;
  energy::ShapeEnergy<Dim>& energy_;
  const FlowOptions& options_;
  Velocity<Dim> velocity_;
  Points<Dim> to_;
  double previous_tau_ = 0;
};

}  // namespace

std::string FlowOptions::error() const {
  if (std::string error = velocity.error(); !error.empty()) return error;
  if (std::string error = step.error(); !error.empty()) return error;
  if (max_steps < 0) return fmt::format("FlowOptions::max_steps = {} violates >= 0", max_steps);
  if (!(rel_tol >= 0 && rel_tol < 1))
    return fmt::format("FlowOptions::rel_tol = {} violates 0 <= rel_tol < 1", rel_tol);
  if (!(energy_tol >= 0 && energy_tol < 1))
    return fmt::format("FlowOptions::energy_tol = {} violates 0 <= energy_tol < 1", energy_tol);
  if (energy_window < 1)
    return fmt::format("FlowOptions::energy_window = {} violates >= 1", energy_window);
  if (!(energy_share_on_the_way >= 0 && energy_share_on_the_way <= 1))
    return fmt::format("FlowOptions::energy_share_on_the_way = {} violates 0 to 1",
                       energy_share_on_the_way);
  if (!(displacement_tol_mm >= 0))
    return fmt::format("FlowOptions::displacement_tol_mm = {} violates >= 0", displacement_tol_mm);
  return {};
}

std::string to_string(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return "converged";
    case Termination::kMaxSteps:
      return "max-steps";
    case Termination::kStalled:
      return "stalled";
    case Termination::kObstacle:
      return "obstacle";
    case Termination::kStopped:
      break;
  }
  return "stopped";
}

template <int Dim>
FlowSummary evolve(MovingShape<Dim>& shape, energy::ShapeEnergy<Dim>& energy,
                   const FlowOptions& options, const StepCallback& callback) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  FlowSummary summary;
  bool is_rebuilt = false;  // J may be off by a constant
  const auto finish = [&](Termination termination, std::string message) {
    if (is_rebuilt) energy.reset(shape.geometry());
    summary.termination = termination;
    summary.message = std::move(message);
    summary.final_energy = energy.value();
    return summary;
  };
  StoppingRule rule(options);
  Stepper<Dim> stepper(shape, energy, options);
  fem::Geometry<Dim> geometry = shape.geometry();
  energy.reset(geometry);
  summary.initial_energy = energy.value();

  for (int k = 1; k <= options.max_steps; ++k) {
    StepRecord record;
    record.k = k;
    if (!stepper.advance(geometry, record))
      return finish(Termination::kStalled, "no step decreases the energy any further");
    shape.move_to(stepper.destination());
    const bool is_remeshed = shape.mend();
    record.events = shape.take_events();
    geometry = shape.geometry();
    is_rebuilt |= shape.has_changed_domain();
    if (shape.has_changed_domain())
      energy.rebuild(geometry);
    else if (is_remeshed)
      energy.remesh(geometry);
    record.enclosed = geometry.enclosed();
    record.n_vertices = geometry.n_vertices();
    record.n_elements = geometry.n_elements();
    summary.steps.push_back(record);
    if (callback && !callback(record)) return finish(Termination::kStopped, "stopped on request");
    if (std::string why = shape.obstacle(); !why.empty())
      return finish(Termination::kObstacle, std::move(why));
    if (std::string why = rule.check(summary, shape.max_displacement()); !why.empty())
      return finish(Termination::kConverged, std::move(why));
  }
  return finish(Termination::kMaxSteps,
                fmt::format("the limit of {} steps was reached", options.max_steps));
}

template FlowSummary evolve<2>(MovingShape<2>&, energy::ShapeEnergy<2>&, const FlowOptions&,
                               const StepCallback&);
template FlowSummary evolve<3>(MovingShape<3>&, energy::ShapeEnergy<3>&, const FlowOptions&,
                               const StepCallback&);

}  // namespace surf::flow
