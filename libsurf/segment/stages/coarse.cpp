#include <algorithm>

#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kCoarseEdges = 2;  // times longer in the coarse part, which the thesis leaves
constexpr double kCoarseShare =
    0.02;  // of the length, exempt from Alg. 3 there: surgery resolves it
// Of the L2 flow, cells: across an edge as wide as the blur G changes by 0.4 per cell, so longer
// ones overshoot.
constexpr double kCoarseL2Step = 2;
constexpr double kCoarseEnergyTol = 0.01;

/// The first part of Alg. 17: fixed steps with coarse curves, and domains that are not adapted to
/// data; then, step by step, the tolerances of the result while |dJ| is above its thresholds.
/// Where |dJ| grows again the printed loop goes back to the coarser tolerance, this does not.
template <int Dim>
class Coarse : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    return may_go_on(work, coarse(work)) && may_go_on(work, continued(work));
  }

 private:
  static bool may_go_on(Work<Dim>& work, const Minimisation<Dim>& part) {
    minimise(work, part);
    const StageReport& report = work.reports.back();
    return report.outcome == Outcome::kConverged ||
           report.flow.termination == flow::Termination::kMaxSteps;
  }

  static Minimisation<Dim> coarse(const Work<Dim>& work) {
    Minimisation<Dim> out;
    out.name = "coarse";
    out.terms = *coarse_terms<Dim>(work.energies);
    out.sigma_mm = work.sigma_mm;
    out.flow = work.options.flow;
    out.flow.step.rule = flow::StepRule::kFixed;
    if (out.flow.velocity.product == flow::ScalarProduct::kL2)
      out.flow.step.tau = kCoarseL2Step * work.cell_mm();
    out.flow.step.exempt_share = std::max(out.flow.step.exempt_share, kCoarseShare);
    out.flow.max_steps = work.options.n_coarse_steps;
    out.flow.energy_tol = std::max(out.flow.energy_tol, kCoarseEnergyTol);
    out.flow.rel_tol = std::min(0.5, work.options.second_threshold * out.flow.rel_tol);
    out.shape = shape_options(work, kCoarseEdges * work.edge_length_mm, work.sigma_mm);
    out.shape.adaptivity.geometry_tolerance_mm *= work.options.coarse_geometry;
    out.shape.max_displacement_mm *= kCoarseEdges;
    return out;
  }

  static Minimisation<Dim> continued(const Work<Dim>& work) {
    Minimisation<Dim> out = coarse(work);
    out.name = "continued";
    out.terms = work.energies;
    out.flow.rel_tol = std::min(0.5, work.options.first_threshold * work.options.flow.rel_tol);
    out.shape = shape_options(work, work.edge_length_mm, work.sigma_mm);
    out.shape.adaptivity.geometry_tolerance_mm *= work.options.continued_geometry;
    return out;
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> coarse_stage() {
  return std::make_unique<Coarse<Dim>>();
}

template StagePointer<2> coarse_stage<2>();
template StagePointer<3> coarse_stage<3>();

}  // namespace surf::segment
