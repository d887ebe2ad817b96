#include <utility>

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
    const double blur = blur_mm(work.reports.back().sigma_mm, work.cell_mm());
    const MinimisedEnergy<Dim> minimised = std::exchange(work.minimised, {});  // no longer needed
    work.shape = moved_past_clicks(
        work, moved_to_edge<Dim>(work.shape, *minimised.energy, blur, kFurthest * work.cell_mm()));
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
