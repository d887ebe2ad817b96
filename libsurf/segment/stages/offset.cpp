#include <chrono>

#include "libsurf/segment/edge_offset.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kFurthest = 0.25;  // cells

/// moved_to_edge() by the last energy that was minimised.
template <int Dim>
class Offset : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const auto begin = std::chrono::steady_clock::now();
    const StageReport& last = work.reports.back();
    const auto model = work.fields.model(field_options(work.options, last.sigma_mm));
    const auto energy = make_energy<Dim>(last.energies, context(work, *model));
    StageReport report;
    report.name = "offset";
    report.kind = StageKind::kCorrects;
    report.message = "the bias of the curvature is taken off";
    report.energies = last.energies;
    report.sigma_mm = last.sigma_mm;
    report.edge_length_mm = last.edge_length_mm;
    work.shape = moved_past_clicks(
        work, moved_to_edge<Dim>(work.shape, *energy, blur_mm(last.sigma_mm, work.cell_mm()),
                                 kFurthest * work.cell_mm()));
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    work.reports.push_back(std::move(report));
    return true;
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
