#include "libsurf/segment/detail/edge_offset.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kFurthest = 0.25;  // cells

/// moved_to_edge() by the last energy that was minimised.
template <int Dim>
class Offset : public CorrectingStage<Dim> {
  const char* name() const override { return "offset"; }

  std::string correct(Work<Dim>& work) const override {
    const StageReport& last = work.reports.back();
    const bool is_at_hand = work.energy && last.kind == StageKind::kMinimises;
    const auto model = work.fields.model(field_options(work.options, last.sigma_mm));
    const std::shared_ptr<energy::EnergySum<Dim>> energy =
        is_at_hand ? work.energy : make_energy<Dim>(last.energies, context(work, *model));
    work.energy.reset();
    work.shape = moved_past_clicks(
        work, moved_to_edge<Dim>(work.shape, *energy, blur_mm(last.sigma_mm, work.cell_mm()),
                                 kFurthest * work.cell_mm()));
    return "the bias of the curvature is taken off";
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> offset_stage() {
  return std::make_unique<Offset<Dim>>();
}

template StagePointer<2> offset_stage<2>();
template StagePointer<3> offset_stage<3>();

}  // namespace surf::segment
