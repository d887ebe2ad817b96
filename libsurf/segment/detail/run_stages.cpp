#include "libsurf/segment/detail/run_stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/segment/detail/point_text.h"
#include "libsurf/segment/detail/work_json.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr int kMostNotes = 5;  // of one kind

/// One note for each kind of what went: how many, how large, where the largest is.
template <int Dim>
void note_removed(const std::vector<Removed<Dim>>& removed, std::vector<std::string>& notes) {
  struct Group {
    int n = 0;
    double total = 0;
    const Removed<Dim>* largest = nullptr;
  };
  std::map<std::string, Group> groups;
  for (const Removed<Dim>& part : removed) {
    Group& group = groups[part.what];
    ++group.n;
    group.total += std::abs(part.content);
    if (!group.largest || std::abs(part.content) > std::abs(group.largest->content))
      group.largest = &part;
  }
  for (const auto& [what, group] : groups) {
    std::string place;
    for (const double x : group.largest->center_mm)
      place += fmt::format("{}{:.4g}", place.empty() ? "" : ", ", x);
    const std::string largest =
        fmt::format("{:.4g} mm^{} at ({}) mm", std::abs(group.largest->content), Dim, place);
    notes.push_back(group.n == 1
                        ? fmt::format("removed: 1 {} of {}", what, largest)
                        : fmt::format("removed: {} x {}, {:.4g} mm^{} in all, the largest of {}",
                                      group.n, what, group.total, Dim, largest));
  }
}

/// One note for each of the first clicks that the shape does not obey, and the number of the
/// others. Of a stroke its first such point is named.
/// @return  where the first is, if there is one
template <int Dim>
std::optional<Vector<Dim>> note_disobeyed(const Simplices<Dim>& shape, const Setting<Dim>& setting,
                                          const std::vector<Click<Dim>>& clicks,
                                          std::vector<std::string>& notes) {
  std::optional<Vector<Dim>> out;
  if (shape.elements.rows() == 0) return out;
  const double half = kLeastDistance * setting.extent().cell_mm();
  int n = 0;
  for (std::size_t k = 0; k < clicks.size(); ++k) {
    const Click<Dim>& click = clicks[k];
    const auto here = clicks.begin() + std::ptrdiff_t(k);
    if (std::find(clicks.begin(), here, click) != here) continue;  // told already
    const std::vector<mesh::HeldPoint<Dim>> held = held_points<Dim>({click});
    const std::vector<char> flags = mesh::are_held<Dim>(shape, held, half, setting.extent());
    const auto first = std::find(flags.begin(), flags.end(), 0);
    if (first == flags.end() || ++n > kMostNotes) continue;
    const Vector<Dim> point = held[std::size_t(first - flags.begin())].point;
    if (!out) out = point;
    const std::string what =
        held.size() == 1
            ? fmt::format("click ({}) mm", point_text<Dim>(point))
            : fmt::format("stroke of {} points, at {} of them, first ({}) mm,", held.size(),
                          std::count(flags.begin(), flags.end(), 0), point_text<Dim>(point));
    const bool is_inside =
        mesh::are_inside<Dim>(shape, Points<Dim>(point.transpose())).front() != 0;
    const char* side = is_inside ? "inside" : "outside";
    const double away = setting.distance_to(shape)(point);
    notes.push_back(
        is_inside == (click.side == Side::kInside)
            ? fmt::format(
                  "{} is not obeyed: it is {} as it should be, but only {:.2g} mm from the {}",
                  what, side, away, setting.noun())
            : fmt::format("{} is not obeyed: it is {} the {}, {:.2g} mm from it", what, side,
                          setting.noun(), away));
  }
  if (n > kMostNotes)
    notes.push_back(fmt::format("{} further clicks are not obeyed", n - kMostNotes));
  return out;
}

/// Whether the next stage may begin.
template <int Dim>
bool run_measured(const Stage<Dim>& stage, Work<Dim>& work) {
  const ResourceMeter meter;
  const std::size_t n_before = work.reports.size();
  const bool goes_on = stage.run(work);
  if (work.reports.size() > n_before) work.reports.back().used = meter.used();
  return goes_on;
}

/// The same; a correction that makes the shape intersect itself is taken back.
template <int Dim>
bool run_checked(const Stage<Dim>& stage, Work<Dim>& work) {
  const Simplices<Dim> before = work.shape;
  const bool goes_on = run_measured(stage, work);
  if (!work.reports.empty() && work.reports.back().kind == StageKind::kCorrects &&
      !work.setting().is_embedded(work.shape)) {
    work.shape = before;
    work.certainty.reset();
    work.notes.push_back(fmt::format("{}: made the {} intersect itself and is taken back",
                                     work.reports.back().name, work.setting().noun()));
  }
  return goes_on;
}

/// Goes on from a checkpoint: none of the stages that are done is run again but the search, which
/// is not in it.
/// @return  the stage to begin with; none: nothing comes after those that are done
template <int Dim>
std::optional<std::size_t> resumed(const std::vector<StagePointer<Dim>>& stages,
                                   const std::string& state, bool searches, Work<Dim>& work) {
  if (state.empty()) return 0;
  const StagesDone done = stages_done(state);
  if (done.n_stages > stages.size()) throw InputError("checkpoint: it has stages of another run");
  if (searches && !run_checked(*stages.front(), work)) return std::nullopt;
  restore(state, work);
  // A stop before anything is told goes back to the last step, as in the run before.
  if (work.stop.stop_possible() && !work.reports.empty() && !work.reports.back().flow.steps.empty())
    work.told = {work.shape, work.border_share, work.reports.size() - 1, work.notes.size(),
                 work.reports.back().flow.steps.size()};
  return done.goes_on ? std::optional(done.n_stages) : std::nullopt;
}

}  // namespace

template <int Dim>
void run_proposal(Work<Dim>& work) {
  run_measured(*propose_stage<Dim>(), work);
}

template <int Dim>
void run_stages(Work<Dim>& work, const Checkpointing& checkpointing) {
  // What is amended begins anew: a state does not hold the region that it moves in.
  const bool is_amended = work.settled != nullptr;
  const bool searches = work.options.energies.empty() && !work.start_is_given;
  const std::vector<StagePointer<Dim>> stages = plan(work);
  const std::optional<std::size_t> first =
      resumed(stages, is_amended ? std::string() : checkpointing.state, searches, work);
  for (std::size_t n = first.value_or(stages.size()); n < stages.size(); ++n) {
    const bool goes_on = run_checked(*stages[n], work);
    const bool is_search = searches && n == 0;
    // Corrections are made again: a stop in a later one takes them back.
    const bool corrects = !work.reports.empty() && work.reports.back().kind == StageKind::kCorrects;
    if (checkpointing.keep && !is_amended && !is_search && !corrects && !work.is_stopped())
      checkpointing.keep(state_of(work, n + 1, goes_on));
    if (!goes_on) break;
  }
  const bool was_cut_short =
      !work.reports.empty() && work.reports.back().outcome == Outcome::kStopped;
  if (was_cut_short && !work.has_stopped) work.go_back_to_told();
}

template <int Dim>
Result<Dim> to_result(Work<Dim> work) {
  Result<Dim> out;
  out.stages = std::move(work.reports);
  if (const StageReport* ending = out.ending_stage()) {
    out.outcome = ending->outcome;
    out.message = ending->message;
  }
  // A proposal is no result: an evolution that was stopped before its first step has none.
  std::optional<Vector<Dim>> disobeyed;
  if (has_shape(out.outcome)) {
    Filtered<Dim> filtered =
        work.setting().filtered(work.shape, work.options.components, work.seeds_mm);
    out.shape = std::move(filtered.shape);
    if (work.certainty)
      out.certainty = certainty_of_part<Dim>(*work.certainty, work.shape, out.shape);
    out.removed = std::move(filtered.removed);
    note_removed<Dim>(out.removed, work.notes);
    if (out.outcome != Outcome::kProposed)
      disobeyed = note_disobeyed<Dim>(out.shape, work.setting(), work.clicks, work.notes);
  }
  out.start = std::move(work.start);
  out.search = std::move(work.search);
  out.proposals = std::move(work.proposals);
  out.chosen = work.chosen;
  if (has_shape(out.outcome)) out.verdict = out.verdict_of_region = std::move(work.verdict);
  if (out.verdict && out.certainty) out.verdict->heed(*out.certainty);
  if (out.verdict && disobeyed) {
    out.verdict->trust = Trust::kDoubtful;
    out.verdict->n_right = out.verdict->n_cases = 0;
    out.verdict->reason = "a click is not obeyed";
    out.verdict->place_mm = *disobeyed;
  }
  out.energies = std::move(work.energies);
  out.notes = std::move(work.notes);
  static_cast<Lengths&>(out) = work;
  out.border_share = work.border_share;
  return out;
}

template void run_proposal<2>(Work<2>&);
template void run_proposal<3>(Work<3>&);
template void run_stages<2>(Work<2>&, const Checkpointing&);
template void run_stages<3>(Work<3>&, const Checkpointing&);
template Result<2> to_result<2>(Work<2>);
template Result<3> to_result<3>(Work<3>);

}  // namespace surf::segment
