// Steps of gradient flows: the velocity of a scalar product, and the search along it.
#include <algorithm>
#include <limits>

#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/detail/stepper.h"

namespace surf::flow {
namespace {

template <int Dim>
class GradientStepper : public Stepper<Dim> {
 public:
  explicit GradientStepper(const StepSetting<Dim>& setting)
      : Stepper<Dim>(setting), velocity_options_(setting.options.velocity) {
    velocity_options_.keeps_content = setting.content.has_value();
  }

  bool advance(const fem::Geometry<Dim>& shape, StepRecord& record) override {
    const SparseMatrix A = fem::stiffness<Dim>(shape);
    energy::ShapeTerms<Dim> terms(shape);
    this->energy_.differentiate(fem::curvature<Dim>(shape, A), 1, terms);
    const VelocitySystem<Dim> system(shape, terms, A, velocity_options_);
    velocity_ = system.solve(previous_tau_);
    const StepOptions& options = this->options_.step;
    const double furthest = this->moving_.max_displacement();
    const double tau_max =
        std::min(largest_step<Dim>(shape, velocity_.vector, furthest, options),
                 options.tau_max.value_or(std::numeric_limits<double>::infinity()));
    if (!(tau_max > 0)) return false;
    const double J = this->energy_.value();
    const auto attempt = [&](double tau) {
      if (system.depends_on_step()) velocity_ = system.solve(tau);
      const double J_new = this->try_displacement(
          shape, bounded_displacement<Dim>(velocity_.vector, tau, furthest, options.bound),
          velocity_.content_direction, record);
      const Points<Dim> moved = this->to_ - shape.points();
      return Trial{J_new - J, terms.derivative.cwiseProduct(moved).sum()};
    };
    const auto step = choose_step(options, first_trial(tau_max), tau_max, attempt);
    record.shape_derivative = velocity_.shape_derivative;
    record.multiplier = velocity_.multiplier;
    if (!step) return false;
    previous_tau_ = step->tau;
    this->accept(shape, record);
    record.tau = step->tau;
    record.n_trials = step->n_trials;
    return true;
  }

 private:
  /// Twice the last step, but for H1 the full inexact Newton step 1 first: longer ones are only
  /// found by the line search, where J falls as fast as a linear function.
  double first_trial(double tau_max) const {
    const bool is_newton = velocity_options_.product == ScalarProduct::kH1;
    double tau = previous_tau_ > 0 ? 2 * previous_tau_ : is_newton ? 1 : tau_max;
    if (is_newton) tau = std::min(tau, std::max(1.0, previous_tau_));
    return std::min(tau, tau_max);
  }

  VelocityOptions velocity_options_;
  Velocity<Dim> velocity_;
  double previous_tau_ = 0;
};

}  // namespace

constexpr StepperMaker kGradientSteppers = stepper_maker<GradientStepper>();

}  // namespace surf::flow
