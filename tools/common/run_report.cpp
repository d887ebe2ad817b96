#include "tools/common/run_report.h"

#include <fmt/format.h>

#include <map>

#include "tools/common/energy_term.h"
#include "tools/common/signals.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

/// "  2 merging, 1 splitting"
std::string words(const std::vector<surf::flow::TopologyEvent>& events) {
  std::map<std::string, int> kinds;
  for (const auto& event : events) ++kinds[to_string(event.kind)];
  std::string out;
  for (const auto& [kind, n] : kinds)
    out += fmt::format("{}{} {}", out.empty() ? "  " : ", ", n, kind);
  return out;
}

template <int Dim>
int iterations(const surf::segment::RunResult<Dim>& result) {
  int n = 0;
  for (const auto& stage : result.stages) n += int(stage.flow.steps.size());
  return n;
}

template <int Dim>
ordered_json events_of(const surf::segment::RunResult<Dim>& result) {
  const char* place = Dim == 3 ? "place_ras_mm" : "place_mm";
  const char* change = Dim == 3 ? "volume_change_mm3" : "area_change_mm2";
  ordered_json out = ordered_json::array();
  for (const auto& stage : result.stages)
    for (const auto& step : stage.flow.steps)
      for (const auto& event : step.events) {
        ordered_json at = ordered_json::array();
        for (int axis = 0; axis < Dim; ++axis) at.push_back(event.place[axis]);
        out.push_back({{"stage", stage.name},
                       {"step", step.k},
                       {"kind", to_string(event.kind)},
                       {place, at},
                       {change, event.enclosed_change}});
      }
  return out;
}

ordered_json texts_of(const std::vector<surf::segment::EnergyTerm>& terms) {
  ordered_json out = ordered_json::array();
  for (const auto& term : terms) out.push_back(to_string(term));
  return out;
}

}  // namespace

std::string step_line(const std::string& stage, const surf::flow::StepRecord& record,
                      const char* elements, const char* content, const char* unit, double seconds) {
  if (record.n_elements == 0)  // of a search
    return fmt::format("{:<20} step {:4}  {:6.1f} s", stage, record.k, seconds);
  return fmt::format(
      "{:<20} step {:4}  J {:<12.6g} tau {:<9.3g} {} {:7}  {} {:<10.5g} {}  {:6.1f} s{}", stage,
      record.k, record.energy, record.tau, elements, record.n_elements, content, record.enclosed,
      unit, seconds, words(record.events));
}

template <int Dim>
ExitCode exit_code_of(const surf::segment::RunResult<Dim>& result) {
  if (const ExitCode code = signal_exit_code(); code != kDone) return code;
  if (result.stages.empty()) return kDone;
  return result.main_stage().flow.termination == surf::flow::Termination::kMaxSteps
             ? kStoppedAtLimit
             : kDone;
}

template <int Dim>
ordered_json outcome_of(const surf::segment::RunResult<Dim>& result) {
  ordered_json out = ordered_json::object();
  if (result.stages.empty()) return out;
  const auto& main = result.main_stage().flow;
  // A search has no energy; the stage that settles what it found has.
  const auto& evolved = main.steps.empty() ? result.last() : main;
  if (!evolved.steps.empty()) out["energy"] = evolved.final_energy;
  out["iterations"] = iterations(result);
  out["stop_reason"] = surf::flow::to_string(main.termination);
  out["stop_message"] = main.message;
  return out;
}

template <int Dim>
ordered_json history_of(const surf::segment::RunResult<Dim>& result) {
  ordered_json out;
  out["topology_events"] = events_of(result);
  out["notes"] = result.notes;
  out["chosen"] = {{"sigma_mm", result.sigma_mm},
                   {"edge_length_mm", result.edge_length_mm},
                   {"seed_radius_mm", result.seed_radius_mm}};
  if (!result.energies.empty()) out["chosen"]["energies"] = texts_of(result.energies);
  const char* content = Dim == 3 ? "volume_mm3" : "area_mm2";
  for (const auto& candidate : result.candidates)
    out["candidates"].push_back({{"score", candidate.score},
                                 {content, candidate.enclosed},
                                 {"energies", texts_of(candidate.energies)}});
  for (const auto& stage : result.stages)
    out["evolution"].push_back({{"stage", stage.name},
                                {"steps", stage.flow.steps.size()},
                                {"energy_before", stage.flow.initial_energy},
                                {"energy_after", stage.flow.final_energy},
                                {"stop_reason", surf::flow::to_string(stage.flow.termination)},
                                {"stop_message", stage.flow.message},
                                {"edge_length_mm", stage.edge_length_mm},
                                {"time_s", stage.seconds}});
  return out;
}

template <int Dim>
std::string conclusion_of(const surf::segment::RunResult<Dim>& result) {
  const auto& main = result.main_stage().flow;
  return fmt::format("{} after {} steps: {}", surf::flow::to_string(main.termination),
                     iterations(result), main.message);
}

template ExitCode exit_code_of<2>(const surf::segment::RunResult<2>&);
template ExitCode exit_code_of<3>(const surf::segment::RunResult<3>&);
template ordered_json outcome_of<2>(const surf::segment::RunResult<2>&);
template ordered_json outcome_of<3>(const surf::segment::RunResult<3>&);
template ordered_json history_of<2>(const surf::segment::RunResult<2>&);
template ordered_json history_of<3>(const surf::segment::RunResult<3>&);
template std::string conclusion_of<2>(const surf::segment::RunResult<2>&);
template std::string conclusion_of<3>(const surf::segment::RunResult<3>&);

}  // namespace surfseg
