#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kTolerance = 30;  // of the flow, times that of the result

/// Multi-resolution, the continuation of 5.2. Lengths are 2^level times those of the result, and
/// the tolerances of the flow kTolerance times: far from the optimum neither pays.
template <int Dim>
class Level : public Stage<Dim> {
 public:
  explicit Level(int level) : level_(level) {}

  bool run(Work<Dim>& work) const override {
    const double scale = std::pow(2.0, level_), cell = work.cell_mm();
    Minimisation<Dim> out;
    out.name = level_name(level_);
    out.sigma_mm = scale * work.sigma_mm;
    out.terms =
        at_blur<Dim>(work.energies, blur_mm(work.sigma_mm, cell), blur_mm(out.sigma_mm, cell));
    out.shape = shape_options(work, scale * work.edge_length_mm, out.sigma_mm);
    out.shape.adaptivity.geometry_tolerance_mm *= scale;
    out.flow = work.options.flow;
    out.flow.rel_tol = std::min(0.5, kTolerance * out.flow.rel_tol);
    out.flow.energy_tol = std::min(0.5, kTolerance * out.flow.energy_tol);
    const Simplices<Dim> before = work.shape;
    const std::optional<double> content_before = work.kept_content;
    minimise(work, out);
    const StageReport& report = work.reports.back();
    const bool has_vanished = report.outcome == Outcome::kVanished;
    if (has_vanished || report.flow.termination == flow::Termination::kObstacle) {
      // What is too small for the level's blur is found on the next one.
      work.shape = before;
      work.kept_content = content_before;
      work.notes.push_back(
          fmt::format("level {}: {}; the next one starts where it did", level_, report.message));
    }
    // A stop in its last call sees that the shape has vanished, and not that it fills the volume.
    if (has_vanished && work.told) {
      work.told->shape = before;
      work.told->n_notes = work.notes.size();
    }
    if (has_vanished && work.has_stopped && !report.flow.steps.empty()) work.note_stop();
    return report.outcome != Outcome::kStopped;
  }

 private:
  int level_;
};

}  // namespace

std::string level_name(int level) { return fmt::format("level {}", level); }

template <int Dim>
StagePointer<Dim> level_stage(int level) {
  return std::make_unique<Level<Dim>>(level);
}

template StagePointer<2> level_stage<2>(int);
template StagePointer<3> level_stage<3>(int);

}  // namespace surf::segment
