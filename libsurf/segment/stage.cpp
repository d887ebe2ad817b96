#include "libsurf/segment/stage.h"

#include <algorithm>

#include "libsurf/base/names.h"
#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {

std::string to_string(StageKind kind) {
  using enum StageKind;
  return name_of(kind,
                 {{kProposes, "proposes"}, {kMinimises, "minimises"}, {kCorrects, "corrects"}});
}

template <int Dim>
bool Work<Dim>::tell(const std::string& stage, const flow::StepRecord& record,
                     const std::function<Simplices<Dim>()>& shape_now) {
  if (stop.stop_requested()) return false;
  if (stop.stop_possible() && record.n_elements > 0)
    told = {shape_now(), border_share, reports.size(), notes.size(), std::size_t(record.k)};
  if (progress && !progress(stage, record, shape_now)) has_stopped = true;
  return !is_stopped();
}

template <int Dim>
void Work<Dim>::go_back_to_told() {
  if (!told) return;
  shape = told->shape;
  border_share = told->border_share;
  certainty.reset();
  notes.resize(told->n_notes);
  reports.resize(told->n_reports + 1);
  reports.back().flow.steps.resize(told->n_steps);
  note_stop();
}

template <int Dim>
void Work<Dim>::note_stop() {
  StageReport& report = reports.back();
  report.outcome = Outcome::kStopped;
  report.message = "stopped on request";
  report.flow.termination = flow::Termination::kStopped;
  report.flow.message = report.message;
  report.flow.final_energy = report.flow.steps.back().energy;
}

template <int Dim>
std::vector<StagePointer<Dim>> plan(const Work<Dim>& work) {
  const Options<Dim>& options = work.options;
  const bool is_automatic = options.energies.empty() && !work.start_is_given;
  const bool has_parts = options.n_coarse_steps > 0 &&
                         options.flow.method == flow::Method::kGradientFlow &&
                         !options.flow.keeps_content();
  std::vector<StagePointer<Dim>> out;
  if (is_automatic) out.push_back(propose_stage<Dim>());
  if (work.unfinished)
    out.push_back(go_on_stage<Dim>());
  else if (!options.energies.empty())
    out.push_back(start_stage<Dim>());
  else
    out.push_back(work.settled ? amend_stage<Dim>() : fit_stage<Dim>());
  std::vector<std::pair<std::string, StagePointer<Dim>>> coarser;
  for (int level = options.n_levels - 1; level > 0; --level)
    coarser.emplace_back(level_name(level), level_stage<Dim>(level));
  const bool is_continued = has_parts && coarse_terms<Dim>(options.energies);
  if (is_continued) coarser.emplace_back(kCoarseName, coarse_stage<Dim>());
  auto next = coarser.begin();
  // What goes on is past those that come before the one in which it was.
  const StageReport* at = work.unfinished ? work.unfinished->main_stage() : nullptr;
  if (at && at->kind == StageKind::kMinimises)
    next =
        std::find_if(next, coarser.end(), [&](const auto& each) { return each.first == at->name; });
  for (; next != coarser.end(); ++next) out.push_back(std::move(next->second));
  out.push_back(is_continued ? continued_stage<Dim>() : evolve_stage<Dim>());
  if (options.open_cavities) out.push_back(cavities_stage<Dim>());
  const bool is_fitted = options.energies.empty() || are_fitted<Dim>(options.energies);
  const bool settles = options.settle && !options.flow.keeps_content() &&
                       (options.energies.empty() || settle_on_edges<Dim>(options.energies));
  if (settles && !is_fitted) out.push_back(settle_stage<Dim>());
  if (settles) out.push_back(offset_stage<Dim>());
  if (options.locate.value_or(settles && is_fitted)) out.push_back(locate_stage<Dim>());
  return out;
}

template struct Work<2>;
template struct Work<3>;
template std::vector<StagePointer<2>> plan<2>(const Work<2>&);
template std::vector<StagePointer<3>> plan<3>(const Work<3>&);

}  // namespace surf::segment
