#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

/// What an energy takes from its start, as statistics of both sides, is not taken again from a
/// shape that is half way.
template <int Dim>
class GoOn : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const Result<Dim>& before = *work.unfinished;
    work.start = before.start;
    work.energies = before.energies;
    work.sigma_mm = before.sigma_mm;
    work.edge_length_mm = before.edge_length_mm;
    work.geometry_tolerance_mm = before.geometry_tolerance_mm;
    work.seed_radius_mm = before.seed_radius_mm;
    work.edge_blur_mm = before.edge_blur_mm;
    work.whole_blur_mm = before.whole_blur_mm;
    StageReport report;
    report.name = "go on";
    report.kind = StageKind::kProposes;
    report.outcome = work.is_stopped() ? Outcome::kStopped : Outcome::kProposed;
    report.message = "from where the evolution before was stopped, with its energy";
    report.sigma_mm = work.sigma_mm;
    report.edge_length_mm = work.edge_length_mm;
    work.reports.push_back(std::move(report));
    return !work.is_stopped();
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> go_on_stage() {
  return std::make_unique<GoOn<Dim>>();
}

template StagePointer<2> go_on_stage<2>();
template StagePointer<3> go_on_stage<3>();

}  // namespace surf::segment
