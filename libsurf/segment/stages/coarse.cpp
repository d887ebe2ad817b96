#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr const char *kContinuedName = "continued", *kLastName = "evolve";
constexpr double kCoarseEdges = 2;  // times longer in the coarse part, which the thesis leaves
constexpr double kCoarseShare =
    0.02;  // of the length, exempt from Alg. 3 there: surgery resolves it
// Of the L2 flow, cells: across an edge as wide as the blur G changes by 0.4 per cell, so longer
// ones overshoot.
constexpr double kCoarseL2Step = 2;
constexpr double kCoarseEnergyTol = 0.01;

/// What both parts of Alg. 17 have before the last steps: fixed ones.
template <int Dim>
Minimisation<Dim> with_fixed_steps(const Work<Dim>& work) {
  Minimisation<Dim> out;
  out.sigma_mm = work.sigma_mm;
  out.flow = work.options.flow;
  out.flow.method = flow::Method::kGradientFlow;  // others look for their steps
  out.flow.step.rule = flow::StepRule::kFixed;
  if (out.flow.velocity.product == flow::ScalarProduct::kL2)
    out.flow.step.tau = kCoarseL2Step * work.cell_mm();
  out.flow.step.exempt_share = std::max(out.flow.step.exempt_share, kCoarseShare);
  out.flow.energy_tol = std::max(out.flow.energy_tol, kCoarseEnergyTol);
  return out;
}

/// Whether the stage that has just run may be followed by another: fixed steps that raise the
/// energy near its minimum have done their part, those that look for their length follow.
template <int Dim>
bool may_go_on(const Work<Dim>& work) {
  const StageReport& report = work.reports.back();
  return report.outcome == Outcome::kConverged ||
         report.flow.termination == flow::Termination::kMaxSteps ||
         report.flow.termination == flow::Termination::kRising;
}

/// The first part of Alg. 17: fixed steps with coarse curves, and domains that are not adapted to
/// data.
template <int Dim>
class Coarse : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    Minimisation<Dim> out = with_fixed_steps(work);
    out.name = kCoarseName;
    out.terms = *coarse_terms<Dim>(work.energies);
    out.flow.max_steps = work.options.n_coarse_steps;
    out.flow.rel_tol = std::min(0.5, work.options.second_threshold * out.flow.rel_tol);
    out.shape = shape_options(work, kCoarseEdges * work.edge_length_mm, work.sigma_mm);
    out.shape.adaptivity.geometry_tolerance_mm *= work.options.coarse_geometry;
    out.shape.max_displacement_mm *= kCoarseEdges;
    minimise(work, out);
    return may_go_on(work);
  }
};

/// The loop of Alg. 17: while |dJ| is in [d_2, infinity) steps are fixed and the tolerance is C_2
/// epsilon_geom, in [d_1, d_2) it is that of the result, below d_1 steps are searched, too. Where
/// |dJ| grows again it goes back. The thresholds are shares of the largest |dJ| since the coarse
/// part began. Where fixed steps gain nothing any more, the next level is taken all the same, and
/// is not left for the one above until |dJ| has been below its threshold.
template <int Dim>
class Continued : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    Level level(work);
    int n_left = work.options.flow.max_steps;
    for (;;) {
      level.begin();
      Minimisation<Dim> out = minimisation(work, level.index());
      out.flow.max_steps = std::min(out.flow.max_steps, n_left);
      out.ends = [&](const flow::StepRecord& record) { return level.check(record); };
      const bool is_converged = minimise(work, out);
      n_left -= int(work.reports.back().flow.steps.size());
      if (level.goes_on()) continue;
      if (level.index() == 0) return is_converged;
      if (!may_go_on(work)) return false;
      level.descend();
    }
  }

 private:
  /// Which interval |dJ| is in.
  class Level {
   public:
    explicit Level(const Work<Dim>& work)
        : thresholds_{work.options.first_threshold * work.options.flow.rel_tol,
                      work.options.second_threshold * work.options.flow.rel_tol},
          may_return_(work.options.continuation_returns) {
      if (work.unfinished) see(work.unfinished->stages);
      see(work.reports);
      index_ = interval();
      // What goes on from the last part does not return to those before it, which began there.
      const StageReport* at = work.unfinished ? work.unfinished->main_stage() : nullptr;
      if (at && at->name == kLastName) index_ = 0;
    }

    int index() const { return index_; }
    void begin() {
      next_ = index_;
      was_here_ = false;
    }
    void descend() { --index_; }
    /// After a minimisation that check() has ended: with the level that |dJ| asks for.
    bool goes_on() {
      const bool is_another = next_ != index_;
      index_ = next_;
      return is_another;
    }

    std::string check(const flow::StepRecord& record) {
      see(record);
      const int now = interval();
      was_here_ = was_here_ || now <= index_;
      if (now == index_ || (now > index_ && !(may_return_ && was_here_))) return {};
      next_ = now;
      return fmt::format("the shape derivative has {} to {:.1e} of its largest value",
                         now < index_ ? "fallen" : "grown again", last_ / largest_);
    }

   private:
    void see(const std::vector<StageReport>& reports) {
      for (const StageReport& report : reports)
        if (report.name == kCoarseName || report.name == kContinuedName || report.name == kLastName)
          for (const flow::StepRecord& step : report.flow.steps) see(step);
    }
    void see(const flow::StepRecord& step) {
      last_ = std::abs(step.shape_derivative);
      largest_ = std::max(largest_, last_);
    }
    int interval() const {
      return int(last_ >= thresholds_[0] * largest_) + int(last_ >= thresholds_[1] * largest_);
    }

    std::array<double, 2> thresholds_;  // d_1, d_2 by the largest |dJ|
    bool may_return_;
    double last_ = 0, largest_ = 0;
    int index_ = 0, next_ = 0;
    bool was_here_ = false;  // |dJ| has been in this interval, or below it
  };

  static Minimisation<Dim> minimisation(const Work<Dim>& work, int level) {
    Minimisation<Dim> out;
    if (level > 0) {
      out = with_fixed_steps(work);
      out.name = kContinuedName;
      out.flow.rel_tol = 0;
    } else {
      out.name = kLastName;
      out.sigma_mm = work.sigma_mm;
      out.flow = work.options.flow;
    }
    out.terms = work.energies;
    out.shape = shape_options(work, work.edge_length_mm, work.sigma_mm);
    if (level == 2) out.shape.adaptivity.geometry_tolerance_mm *= work.options.continued_geometry;
    return out;
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> coarse_stage() {
  return std::make_unique<Coarse<Dim>>();
}

template <int Dim>
StagePointer<Dim> continued_stage() {
  return std::make_unique<Continued<Dim>>();
}

template StagePointer<2> coarse_stage<2>();
template StagePointer<3> coarse_stage<3>();
template StagePointer<2> continued_stage<2>();
template StagePointer<3> continued_stage<3>();

}  // namespace surf::segment
