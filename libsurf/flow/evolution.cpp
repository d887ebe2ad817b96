#include "libsurf/flow/evolution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/names.h"
#include "libsurf/flow/content.h"
#include "libsurf/flow/detail/stepper.h"

namespace surf::flow {
namespace {

constexpr double kAtBound = 0.9;  // of the largest displacement
constexpr double kAtRest = 0.1;   // likewise: the fastest vertex hardly moves
constexpr int kLongestWindow = 1'000'000;
constexpr int kDriftWindows = 5;  // of the energy window: how long mending may take back all gains
// What J may rise in a window at rest, by what mending changes: of the whole decrease and of J.
constexpr double kRiseOfDecrease = 0.05, kRiseOfEnergy = 1e-3;

/// Why a run ends.
struct End {
  Termination termination = Termination::kConverged;
  std::string message;
};

/// Has the run come to rest?
class StoppingRule {
 public:
  explicit StoppingRule(const FlowOptions& options) : options_(options) {}

  /// Nothing while it has not.
  /// @param bound_mm  on the displacement of a vertex in a step
  /// @param drift     of the energy after the step
  std::optional<End> check(const FlowSummary& summary, double bound_mm, double drift) {
    const StepRecord& last = summary.steps.back();
    with_drift_.push_back(last.energy + drift);
    steepest_ = std::max(steepest_, std::abs(last.shape_derivative));
    const bool is_at_rest = last.max_displacement_mm <= kAtRest * bound_mm;
    // A dent of few vertices, where fronts met last, adds little to dJ.
    if (std::abs(last.shape_derivative) <= options_.rel_tol * steepest_ && is_at_rest)
      return rest(fmt::format("the shape derivative fell to {:.1e} of its largest value",
                              std::abs(last.shape_derivative) / steepest_));
    n_at_bound_ = last.max_displacement_mm > kAtBound * bound_mm ? n_at_bound_ + 1 : 0;
    // A round of L-BFGS that ended inside its chart stands for many steps.
    const bool is_round = options_.method == Method::kLbfgs && is_at_rest;
    const int window = is_round ? 1 : options_.energy_window;
    const int n = static_cast<int>(summary.steps.size());
    if (n <= window) return {};
    const double gained = summary.steps[n - 1 - window].energy - last.energy;
    const double total = summary.initial_energy - last.energy;
    const double share = n_at_bound_ >= window ? options_.energy_share_on_the_way : 1;
    const auto is_small = [&](double gain, double tolerance) {
      return gain <= tolerance * total && !has_risen(gain, summary);
    };
    if (is_small(gained, share * options_.energy_tol) && is_round)
      return rest(
          fmt::format("the last round gained {:.1e} of the whole decrease", gained / total));
    if (is_small(gained, share * options_.energy_tol))
      return rest(fmt::format("the last {} steps gained {:.1e} of the whole decrease", window,
                              gained / total));
    if (const int longer = kDriftWindows * window; n > longer) {
      const double gain = with_drift_[n - 1 - longer] - with_drift_[n - 1];
      if (has_risen(gain, summary))
        return End{Termination::kRising,
                   fmt::format("J rose by {:.2g} in the last {} steps: mending the mesh adds more "
                               "to it than they take; shorter edges may help",
                               -gain, longer)};
      if (drift != 0 && is_small(gain, options_.energy_tol))
        return rest(fmt::format("mending took back what the last {} steps gained", longer));
    }
    double furthest = 0;
    for (int k = n - window; k < n; ++k)
      furthest = std::max(furthest, summary.steps[k].max_displacement_mm);
    if (furthest <= options_.displacement_tol_mm)
      return rest(fmt::format("no vertex moved further than {:.2g} mm in the last {} steps",
                              furthest, window));
    return {};
  }

 private:
  static End rest(std::string why) { return {Termination::kConverged, std::move(why)}; }

  static bool has_risen(double gain, const FlowSummary& summary) {
    const double first = summary.initial_energy, last = summary.steps.back().energy;
    return -gain > kRiseOfDecrease * std::max(first - last, 0.0) &&
           -gain > kRiseOfEnergy * std::max(std::abs(first), std::abs(last));
  }

  const FlowOptions& options_;
  double steepest_ = 0;
  std::vector<double> with_drift_;  // energies, step by step
  int n_at_bound_ = 0;  // steps up to the last one whose displacement was about the largest
};

/// The content is brought to its target in bounded moves, and held there when the mesh was mended.
template <int Dim>
class ContentKeeper {
 public:
  ContentKeeper(MovingShape<Dim>& shape, double target) : shape_(shape), target_(target) {}

  /// A move along the normals as far as needed, or as far as a step may go. True if that is enough.
  bool move() {
    const fem::Geometry<Dim> now = shape_.geometry();
    Points<Dim> to = now.points();
    const double longest = std::min(shape_.max_displacement(), kLargestMove * now.radius());
    const bool is_reached =
        correct_content<Dim>(to, now.elements(), now.directions(), target_, longest);
    shape_.restrict_move(to);
    shape_.move_to(to);
    return is_reached;
  }

  /// Moves and mends until it is reached; false if it cannot be, or at a stop.
  bool approach(const std::stop_token& stop) {
    double before = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kMostMoves && shape_.obstacle().empty() && !stop.stop_requested(); ++k) {
      if (move() && k > 0 && !is_far()) return true;
      shape_.mend();
      const double left = std::abs(shape_.geometry().enclosed() - target_);
      if (left >= before && left > kNear * std::abs(target_)) return false;
      before = left;
    }
    return false;
  }

  double target() const { return target_; }
  bool is_far() const {
    return std::abs(shape_.geometry().enclosed() - target_) > kNear * std::abs(target_);
  }

 private:
  static constexpr double kLargestMove = 0.1;  // of the radius
  static constexpr double kNear = 1e-3;        // of the content: what mending changes is far less
  static constexpr int kMostMoves = 1000;

  MovingShape<Dim>& shape_;
  double target_;
};

}  // namespace

std::string FlowOptions::error() const {
  if (std::string error = velocity.error(); !error.empty()) return error;
  if (std::string error = step.error(); !error.empty()) return error;
  if (content && !(*content > 0))
    return fmt::format("FlowOptions::content = {} violates > 0", *content);
  if (keeps_content() && method == Method::kLbfgs)
    return "FlowOptions::keep_content: L-BFGS cannot keep the content; use a gradient flow or "
           "Newton's method";
  if (method != Method::kGradientFlow && velocity.scheme == Scheme::kSemiImplicit)
    return "FlowOptions::velocity.scheme: only gradient flows are semi-implicit";
  if (method != Method::kGradientFlow && step.bound == StepBound::kVertex)
    return "FlowOptions::step.bound: only gradient flows bound each vertex for itself";
  if (max_steps < 0) return fmt::format("FlowOptions::max_steps = {} violates >= 0", max_steps);
  if (!(rel_tol >= 0 && rel_tol < 1))
    return fmt::format("FlowOptions::rel_tol = {} violates 0 <= rel_tol < 1", rel_tol);
  if (!(energy_tol >= 0 && energy_tol < 1))
    return fmt::format("FlowOptions::energy_tol = {} violates 0 <= energy_tol < 1", energy_tol);
  if (energy_window < 1 || energy_window > kLongestWindow)
    return fmt::format("FlowOptions::energy_window = {} violates 1 to {}", energy_window,
                       kLongestWindow);
  if (!(energy_share_on_the_way >= 0 && energy_share_on_the_way <= 1))
    return fmt::format("FlowOptions::energy_share_on_the_way = {} violates 0 to 1",
                       energy_share_on_the_way);
  if (!(displacement_tol_mm >= 0))
    return fmt::format("FlowOptions::displacement_tol_mm = {} violates >= 0", displacement_tol_mm);
  return {};
}

std::string to_string(Termination termination) {
  using enum Termination;
  return name_of(termination, {{kConverged, "converged"},
                               {kMaxSteps, "max-steps"},
                               {kStalled, "stalled"},
                               {kRising, "rising"},
                               {kObstacle, "obstacle"},
                               {kStopped, "stopped"}});
}

namespace {

/// The run of a flow.
template <int Dim>
class Evolution {
 public:
  Evolution(MovingShape<Dim>& shape, energy::ShapeEnergy<Dim>& energy, const FlowOptions& options)
      : shape_(shape), energy_(energy), options_(options) {}

  FlowSummary run(const StepCallback& callback) {
    const bool keeps = options_.keeps_content();
    if (keeps) keeper_.emplace(shape_, options_.content.value_or(shape_.geometry().enclosed()));
    const bool is_there = !options_.content || keeper_->approach(options_.stop);
    geometry_ = std::make_unique<fem::Geometry<Dim>>(shape_.geometry());
    energy_.reset(*geometry_);
    summary_.initial_energy = energy_.value();
    if (!is_there && options_.stop.stop_requested())
      return finish(Termination::kStopped, "stopped on the way to the content to keep");
    if (!is_there) return finish(Termination::kObstacle, unreached());

    StoppingRule rule(options_);
    const auto stepper = make_stepper<Dim>(
        {shape_, energy_, options_,
         keeps ? std::optional<double>(keeper_->target()) : std::optional<double>()});
    for (int k = 1; k <= options_.max_steps; ++k) {
      StepRecord record;
      record.k = k;
      if (!stepper->advance(*geometry_, record)) return finish_without_step();
      record.energy += left_out_;
      shape_.move_to(stepper->destination());
      mend(record);
      if (k % (kDriftWindows * options_.energy_window) == 0) measure_drift();
      summary_.steps.push_back(record);
      if (callback && !callback(record)) return finish(Termination::kStopped, "stopped on request");
      if (std::string why = shape_.obstacle(); !why.empty())
        return finish(Termination::kObstacle, std::move(why));
      if (std::optional<End> end = rule.check(summary_, shape_.max_displacement(), energy_.drift()))
        return finish(end->termination, std::move(end->message));
    }
    return finish(Termination::kMaxSteps,
                  fmt::format("the limit of {} steps was reached", options_.max_steps));
  }

 private:
  void mend(StepRecord& record) {
    const bool is_remeshed = shape_.mend();
    record.events = shape_.take_events();
    const bool has_changed_domain = shape_.has_changed_domain();
    const bool is_far = keeper_ && keeper_->is_far();  // by surgery
    if (is_far) keeper_->approach(options_.stop);
    fem::Geometry<Dim> now = shape_.geometry();
    const bool is_part = now.is_part() || geometry_->is_part();
    const double before = energy_.value();
    is_off_ |= has_changed_domain || is_far || is_remeshed;
    if (has_changed_domain || is_far)
      energy_.rebuild(now);
    else if (is_remeshed || is_part || !now.has_border_of(*geometry_))
      energy_.remesh(now);
    else
      now = geometry_->moved_to(now.points());  // what the energy has, with the rim that it charges
    if (is_part) left_out_ += before - energy_.value();
    *geometry_ = std::move(now);
    if (keeper_ && is_remeshed && !is_far) hold_content(record);
    const ShapeSize size = shape_.size();
    record.enclosed = size.enclosed;
    record.n_vertices = size.n_vertices;
    record.n_elements = size.n_elements;
  }

  /// J from scratch: of what mending changes in a domain its energy knows an estimate or nothing.
  /// A contour at its minimum went on for ever where each step gained what mending then took back.
  void measure_drift() {
    if (!geometry_->is_part()) energy_.rebuild(*geometry_);
  }

  /// Takes back what mending has changed.
  void hold_content(StepRecord& record) {
    keeper_->move();
    *geometry_ = geometry_->moved_to(shape_.geometry().points());
    energy_.try_move(*geometry_);
    energy_.accept();
    record.energy = energy_.value();
  }

  /// With a least step others may have been left.
  FlowSummary finish_without_step() {
    if (std::string why = shape_.obstacle(); !why.empty())
      return finish(Termination::kObstacle, std::move(why));
    const double least = options_.step.tau_min;
    if (least > 0 && options_.method == Method::kGradientFlow)
      return finish(Termination::kMaxSteps,
                    fmt::format("no time step of {:g} or more decreases the energy", least));
    return finish(Termination::kStalled, "no step decreases the energy any further");
  }

  std::string unreached() const {
    return fmt::format("the content {:.6g} mm^{} cannot be reached: the shape is held at {:.6g}",
                       keeper_->target(), Dim, geometry_->enclosed());
  }

  FlowSummary finish(Termination termination, std::string message) {
    // L-BFGS adds up what its many evaluations sweep: 0.5 % of chan-vese on a torus of 96^3 voxels.
    if (!geometry_->is_part() && (is_off_ || options_.method == Method::kLbfgs))
      energy_.reset(shape_.geometry());
    summary_.termination = termination;
    summary_.message = std::move(message);
    summary_.final_energy = energy_.value() + energy_.drift() + left_out_;
    return std::move(summary_);
  }

  MovingShape<Dim>& shape_;
  energy::ShapeEnergy<Dim>& energy_;
  const FlowOptions& options_;
  FlowSummary summary_;
  std::optional<ContentKeeper<Dim>> keeper_;
  std::unique_ptr<fem::Geometry<Dim>> geometry_;
  bool is_off_ = false;  // J may be, by what mending and surgery changed
  double left_out_ = 0;  // what J has lost with elements that left the part that moves
};

}  // namespace

template <int Dim>
FlowSummary evolve(MovingShape<Dim>& shape, energy::ShapeEnergy<Dim>& energy,
                   const FlowOptions& options, const StepCallback& callback) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return Evolution<Dim>(shape, energy, options).run(callback);
}

template FlowSummary evolve<2>(MovingShape<2>&, energy::ShapeEnergy<2>&, const FlowOptions&,
                               const StepCallback&);
template FlowSummary evolve<3>(MovingShape<3>&, energy::ShapeEnergy<3>&, const FlowOptions&,
                               const StepCallback&);

}  // namespace surf::flow
