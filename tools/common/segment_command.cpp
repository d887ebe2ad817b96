#include "tools/common/segment_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tools/common/config.h"
#include "tools/common/field_names.h"
#include "tools/common/memory_limit.h"
#include "tools/common/profile.h"
#include "tools/common/program.h"
#include "tools/common/report.h"
#include "tools/common/signals.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

/// "  2 merging, 1 splitting"
std::string words(const std::vector<surf::flow::TopologyEvent>& events) {
  std::map<std::string, int> kinds;
  for (const auto& event : events) ++kinds[surf::flow::to_string(event.kind)];
  std::string out;
  for (const auto& [kind, n] : kinds)
    out += fmt::format("{}{} {}", out.empty() ? "  " : ", ", n, kind);
  return out;
}

/// Whether the order of clicks may matter and is not known.
bool has_lost_order(const CLI::App& command, const RunArguments& a) {
  if (a.seeds.size() < 2 || a.outside.empty()) return false;
  const std::vector<CLI::Option*> typed = command.parse_order();
  return std::none_of(typed.begin(), typed.end(), [](const CLI::Option* option) {
    return option->check_lname("seed") || option->check_lname("outside");
  });
}

constexpr const char* kCandidate = ".candidate-";

/// "organs/liver.candidate-2.stl"
std::string candidate_path(const std::string& output, std::size_t number) {
  const std::filesystem::path path(output);
  return (path.parent_path() / fmt::format("{}{}{}{}", path.stem().string(), kCandidate, number,
                                           path.extension().string()))
      .string();
}

/// The number in "liver.candidate-2.stl".
std::optional<std::size_t> candidate_number(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  const std::size_t at = name.rfind(kCandidate);
  unsigned number = 0;
  if (at == std::string::npos || std::sscanf(&name[at], ".candidate-%9u", &number) != 1)
    return std::nullopt;
  return number;
}

/// "; trusted: right in 65 of 69 such cases", "" if there is none.
template <int Dim>
std::string verdict_of(const surf::segment::Result<Dim>& result) {
  return result.verdict ? "; " + result.verdict->text() : "";
}

/// ", volume +- 0.0123 ml, 1.2 % without an edge, next click at (...) mm"; areas in mm^2
template <int Dim>
std::string certainty_of(const surf::segment::Finished<Dim>& finished) {
  if (!finished.certainty) return "";
  const auto& certainty = *finished.certainty;
  std::string out = Dim == 3
                        ? fmt::format(", volume +- {:.3g} ml", certainty.content_deviation / 1000)
                        : fmt::format(", area +- {:.3g} mm^2", certainty.content_deviation);
  if (certainty.share_without_edge > 0)
    out += fmt::format(", {:.3g} % without an edge", 100 * certainty.share_without_edge);
  if (certainty.next_click_mm)
    out += fmt::format(
        ", next click at ({:.4g}) mm",
        fmt::join(certainty.next_click_mm->begin(), certainty.next_click_mm->end(), ", "));
  return out;
}

}  // namespace

std::vector<Output> candidate_outputs(const RunArguments& a, const std::string& output,
                                      const std::vector<Output>& inputs) {
  if (!a.candidates) return {};
  std::set<std::size_t> numbers;
  for (const auto& [option, input] : inputs)
    for (const std::string& path : {input, surf::end_of_links(input)})
      if (const auto number = candidate_number(path)) numbers.insert(*number);
  std::vector<Output> out;
  for (const std::size_t number : numbers)
    out.emplace_back("-o, --candidates", candidate_path(output, number));
  return out;
}

template <int Dim>
std::string step_line(const std::string& stage, const surf::flow::StepRecord& record,
                      double seconds) {
  if (record.n_elements == 0)  // of a stage that proposes
    return fmt::format("{:<20} step {:4}  {:6.1f} s", stage, record.k, seconds);
  return fmt::format(
      "{:<20} step {:4}  J {:<12.6g} tau {:<9.3g} {} {:7}  {} {:<10.5g} mm^{}  {:6.1f} s{}", stage,
      record.k, record.energy, record.tau, Dim == 3 ? "triangles" : "elements", record.n_elements,
      Dim == 3 ? "volume" : "area", record.enclosed, Dim, seconds, words(record.events));
}

ExitCode exit_code_of(surf::segment::Outcome outcome) {
  if (const ExitCode code = signal_exit_code(); code != kDone) return code;
  return ExitCode(surf::segment::exit_code(outcome));
}

template <int Dim>
std::string conclusion_of(const surf::segment::Result<Dim>& result) {
  return fmt::format("{} after {} steps: {}", surf::segment::to_string(result.outcome),
                     result.n_steps(), result.message);
}

template <int Dim>
SegmentCommand<Dim>::SegmentCommand(const CLI::App& command, const RunArguments& arguments)
    : command_(command),
      arguments_(arguments),
      progress_(arguments.verbosity()),
      checkpoint_(arguments.checkpoint, arguments.resume) {}

template <int Dim>
surf::segment::ProgressOf<Dim> SegmentCommand<Dim>::on_step() {
  return [this](const std::string& stage, const surf::flow::StepRecord& record,
                const std::function<Shape()>& shape) {
    progress_.step(step_line<Dim>(stage, record, clock_.total_seconds()));
    tell(stage, record);
    if (record.n_elements > 0) show(shape);
    return signal_exit_code() == kDone;
  };
}

template <int Dim>
typename SegmentCommand<Dim>::Objects SegmentCommand<Dim>::segment(const Input& input) {
  surf::segment::Segmentation<Dim> segmentation(input.setting, max_kept_bytes_);
  for (const ObjectInput<Dim>& object : input.objects) {
    const int id = segmentation.add_object(object.name);
    segmentation.set_options(id, object.options);
    for (const auto& click : surf::segment::clicks_of(object.options))
      segmentation.add_click(id, click);
    for (const auto& stroke : object.strokes) segmentation.add_click(id, stroke);
  }
  checkpoint_.begin([&] { return surf::segment::to_recipe<Dim>(segmentation); });
  const SignalStop stop;
  Objects out;
  for (const int id : segmentation.objects()) {
    segmentation.set_checkpointing(checkpoint_.of(out.size()));
    if (input.objects.size() > 1 && signal_exit_code() == kDone)
      progress_.note(fmt::format("{}:", segmentation.object(id).name));
    if (signal_exit_code() == kDone) segmentation.evolve(id, on_step(), stop.token());
    out.push_back({segmentation.object(id), {}});
    if (arguments_.candidates) out.back().candidates = segmentation.candidates(id);
  }
  if (!arguments_.recipe.empty())
    surf::segment::write_recipe<Dim>(arguments_.recipe, segmentation, image_path(), series_uid());
  return out;
}

/// Each in a file of its own, but for those that fail a guarantee.
template <int Dim>
ordered_json SegmentCommand<Dim>::write_candidates(const surf::segment::Setting<Dim>& setting,
                                                   const SegmentedObject<Dim>& object) {
  const std::string output_path = object_path(output(), object.object.name);
  ordered_json out = ordered_json::array();
  if (!object.object.result->search) return out;  // nothing was looked for
  // Those of a run before are no candidates of this one.
  std::error_code ignored;
  for (std::size_t n = 1; std::filesystem::remove(candidate_path(output_path, n), ignored);) ++n;
  for (std::size_t n = 0; n < object.candidates.size(); ++n) {
    const surf::segment::Candidate<Dim>& candidate = object.candidates[n];
    const std::string path = candidate_path(output_path, n + 1);
    std::string words = fmt::format("candidate {}: {}", n + 1, to_string(candidate));
    ordered_json entry = {{"number", n + 1},
                          {"click", candidate.n_click},
                          {"rank", candidate.rank},
                          {"chosen", candidate.is_chosen},
                          {"score", candidate.proposal.score},
                          {Dim == 3 ? "volume_mm3" : "area_mm2", candidate.proposal.enclosed},
                          {"what", to_string(candidate.proposal)}};
    try {
      write_shape(
          path,
          surf::segment::finish<Dim>(setting, candidate.proposal, surf::extension(output_path)),
          object.object);
      entry["file"] = path;
      words += ": " + path;
    } catch (const surf::InvalidMesh& error) {
      entry["not_written"] = error.what();
      words += fmt::format(": {} not written: {}", path, error.what());
    }
    progress_.note(words);
    out.push_back(std::move(entry));
  }
  return out;
}

template <int Dim>
ExitCode SegmentCommand<Dim>::run() {
  check();
  max_kept_bytes_ = limit_memory(arguments_.memory);
  std::unique_ptr<surf::ThreadLimit> limit;
  if (arguments_.threads > 0) limit = std::make_unique<surf::ThreadLimit>(arguments_.threads);
  clock_.begin("read");
  const Input input = read();
  for (const std::string& idle : idle_options()) progress_.note("note: " + idle);
  if (has_lost_order(command_, arguments_))
    progress_.note(
        "note: --config does not hold in which order --seed and --outside were given: all seeds "
        "come first; replay a --recipe, which does");
  catch_signals();
  clock_.begin("segment");
  const Objects objects = segment(input);
  clock_.begin("verify");
  std::vector<const Result*> results;
  std::vector<std::string> names;
  for (const SegmentedObject<Dim>& object : objects) {
    results.push_back(object.object.result.get());
    names.push_back(object.object.name);
  }
  const Finished finished =
      surf::segment::finish_objects<Dim>(*input.setting, results, surf::extension(output()), names);
  clock_.begin("write");
  const auto is_wanted = [](const SegmentedObject<Dim>& object) { return object.is_wanted; };
  const bool are_several = std::count_if(objects.begin(), objects.end(), is_wanted) > 1;
  const auto one = std::find_if(objects.begin(), objects.end(), is_wanted);
  const ExitCode exit_code =
      are_several ? run_several(input, objects, finished)
                  : run_one(input, objects, finished, std::size_t(one - objects.begin()));
  if (arguments_.profile) note_profile(objects);
  if (signal_exit_code() == kDone) checkpoint_.remove();
  return exit_code;
}

template <int Dim>
void SegmentCommand<Dim>::note_profile(const Objects& objects) {
  std::vector<ObjectStages> stages;
  for (const SegmentedObject<Dim>& object : objects)
    stages.emplace_back(objects.size() > 1 ? object.object.name : "", object.object.result->stages);
  for (const std::string& line : profile_lines(clock_, stages)) progress_.note(line);
}

/// Each wanted object has its label; one alone has 1.
template <int Dim>
void SegmentCommand<Dim>::write_labels_of(const Input& input, const Objects& objects,
                                          const Finished& finished) {
  if (labels_path().empty()) return;
  std::vector<std::uint8_t> labels =
      surf::segment::label_map<Dim>(*input.setting, image_box(), finished);
  std::vector<std::uint8_t> now(objects.size() + 1);
  const auto n_wanted = std::count_if(objects.begin(), objects.end(),
                                      [](const auto& object) { return object.is_wanted; });
  std::vector<surf::volume::LabelName> names;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (!objects[n].is_wanted) continue;
    now[n + 1] = std::uint8_t(n_wanted == 1 ? 1 : n + 1);
    names.push_back({now[n + 1], objects[n].object.name, objects[n].object.colour});
  }
  for (std::uint8_t& label : labels) label = now[label];
  write_labels(labels, names);
}

template <int Dim>
void SegmentCommand<Dim>::note_result(const Result& result, const std::string& name) {
  const std::string whose = name.empty() ? "" : name + ": ";
  if (result.chosen < result.proposals.size())
    progress_.note(fmt::format("found: {}{}", whose, to_string(result.proposals[result.chosen])));
  for (const std::string& note : result.notes)
    progress_.note(fmt::format("note: {}{}", whose, note));
  if (result.border_share > 0)
    progress_.note(
        fmt::format("note: {}the {} ends at the border of the {} with {:.1f} % of its {}", whose,
                    Dim == 3 ? "surface" : "curve", Dim == 3 ? "volume" : "image",
                    100 * result.border_share, Dim == 3 ? "area" : "length"));
}

template <int Dim>
void SegmentCommand<Dim>::note_walls(const Objects& objects, const Finished& finished,
                                     std::size_t n) {
  for (const surf::segment::Wall& wall : finished[n].walls)
    progress_.note(fmt::format(
        "note: {}: {:.4g} mm^{} that '{}' has too went, which comes before it; {:.4g} mm{} of its "
        "wall is theirs, no more than {:.2g} mm apart{}",
        objects[n].object.name, wall.removed, Dim, objects[wall.other].object.name, wall.measure,
        Dim == 3 ? "^2" : "", wall.greatest_gap,
        wall.n_crumbs == 0 ? "" : fmt::format("; {} crumbs went with it", wall.n_crumbs)));
}

template <int Dim>
ordered_json SegmentCommand<Dim>::walls_to_json(const Objects& objects, const Finished& finished,
                                                std::size_t n) const {
  ordered_json out = ordered_json::array();
  for (const surf::segment::Wall& wall : finished[n].walls)
    out.push_back({{"with", objects[wall.other].object.name},
                   {Dim == 3 ? "removed_mm3" : "removed_mm2", wall.removed},
                   {Dim == 3 ? "area_mm2" : "length_mm", wall.measure},
                   {"greatest_gap_mm", wall.greatest_gap},
                   {"crumbs", wall.n_crumbs}});
  return out;
}

template <int Dim>
ExitCode SegmentCommand<Dim>::run_one(const Input& input, const Objects& objects,
                                      const Finished& finished, std::size_t n) {
  const surf::segment::Object<Dim>& object = objects[n].object;
  const Result& result = *object.result;
  const std::string path = object_path(output(), object.name);
  ordered_json candidates;
  // Where nothing was found, or the result fails, they are what a user wants to look at.
  if (arguments_.candidates) candidates = write_candidates(*input.setting, objects[n]);
  const surf::segment::Finished<Dim>* shape =
      finished[n].finished ? &*finished[n].finished : nullptr;
  const auto entries = [&](const surf::segment::Measures<Dim>* failed, const std::string& why) {
    auto out = ordered_json::parse(failed ? surf::segment::summary_json<Dim>(result, *failed)
                                          : surf::segment::summary_json<Dim>(result, shape));
    if (!why.empty()) out["not_written"] = why;
    if (shape) measure(object, *shape, 0, out);
    if (objects.size() > 1) out["walls"] = walls_to_json(objects, finished, n);
    if (arguments_.candidates) out["candidates"] = candidates;
    return out;
  };
  const auto tell_all = [&](ExitCode code, const std::string& why = {},
                            const surf::segment::Measures<Dim>* failed = nullptr) {
    const ordered_json entry = entries(failed, why);
    summarise(code, entry);
    write_report(code, {{&object, shape, entry}});
  };
  try {
    if (finished[n].failure) std::rethrow_exception(finished[n].failure);
  } catch (const surf::NoObject& error) {
    const ExitCode code = signal_exit_code() == kDone ? kNoObject : signal_exit_code();
    note_result(result, "");
    tell_all(code, with_option_names(error.what(), program()));
    if (code != kNoObject) throw;
    throw surf::NoObject(fmt::format("{}: not written: {}", path, error.what()));
  } catch (const surf::InvalidMesh& error) {
    const auto measures = input.setting->measures(result.shape);
    note_result(result, "");
    tell_all(kInvalidResult, error.what(), &measures);
    throw surf::InvalidMesh(fmt::format("{}: not written: {}", path, error.what()));
  }
  write(object, *shape);
  write_together(shape->shape, object.clicks);
  write_labels_of(input, objects, finished);
  const ExitCode exit_code = exit_code_of(result.outcome);
  note_result(result, "");
  note_walls(objects, finished, n);
  tell_all(exit_code);
  progress_.note(conclusion_of<Dim>(result));
  progress_.note(fmt::format("{}: {}{}, {:.2f} s{}", path, describe(shape->measures),
                             certainty_of<Dim>(*shape), clock_.total_seconds(),
                             verdict_of<Dim>(result)));
  return exit_code;
}

/// What could be made is written; what could not is told at the end.
template <int Dim>
ExitCode SegmentCommand<Dim>::run_several(const Input& input, const Objects& objects,
                                          const Finished& finished) {
  ordered_json entries = ordered_json::array();
  std::vector<ReportedObject<Dim>> reported;
  std::vector<Shape> shapes;
  std::vector<surf::segment::Click<Dim>> clicks;
  std::vector<std::string> failures;
  bool is_at_limit = false;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (!objects[n].is_wanted) continue;
    const surf::segment::Object<Dim>& object = objects[n].object;
    const Result& result = *object.result;
    const std::string path = object_path(output(), object.name);
    ordered_json entry = {{"name", object.name}, {"label", n + 1}};
    ordered_json candidates;
    if (arguments_.candidates) candidates = write_candidates(*input.setting, objects[n]);
    ExitCode code = exit_code_of(result.outcome);
    const surf::segment::Finished<Dim>* shape =
        finished[n].finished ? &*finished[n].finished : nullptr;
    note_result(result, object.name);
    clicks.insert(clicks.end(), object.clicks.begin(), object.clicks.end());
    if (shape) {
      write(object, *shape);
      shapes.push_back(shape->shape);
      is_at_limit |= code == kStoppedAtLimit;
      entry["file"] = path;
      note_walls(objects, finished, n);
      progress_.note(
          fmt::format("{}: {}; {}{}", path, describe(shape->measures) + certainty_of<Dim>(*shape),
                      surf::segment::to_string(result.outcome), verdict_of<Dim>(result)));
    } else {
      try {
        std::rethrow_exception(finished[n].failure);
      } catch (const surf::NoObject& error) {
        const bool is_interrupted = signal_exit_code() != kDone;
        entry["not_written"] = is_interrupted && result.outcome == surf::segment::Outcome::kEmpty
                                   ? "interrupted before it was begun"
                                   : with_option_names(error.what(), program());
        if (!is_interrupted) code = kNoObject;
      } catch (const surf::InvalidMesh& error) {
        entry["not_written"] = error.what();
        code = kInvalidResult;
      }
      failures.push_back(
          fmt::format("{}: {}", path, entry["not_written"].template get<std::string>()));
    }
    entry["exit_code"] = int(code);
    entry.update(ordered_json::parse(surf::segment::summary_json<Dim>(result, shape)));
    if (shape) measure(object, *shape, int(n + 1), entry);
    entry["walls"] = walls_to_json(objects, finished, n);
    if (arguments_.candidates) entry["candidates"] = candidates;
    reported.push_back({&object, shape, entry});
    entries.push_back(std::move(entry));
  }
  if (!shapes.empty()) {
    write_together(input.setting->joined(shapes), clicks);
    write_labels_of(input, objects, finished);
  }
  ExitCode exit_code = signal_exit_code();
  if (exit_code == kDone)
    exit_code = !failures.empty() ? kBatchFailed : is_at_limit ? kStoppedAtLimit : kDone;
  summarise(exit_code, {{"objects", entries}});
  write_report(exit_code, reported);
  progress_.note(fmt::format("{} of {} objects written, {:.2f} s", shapes.size(), entries.size(),
                             clock_.total_seconds()));
  if (exit_code == kBatchFailed)
    throw PartFailed(fmt::format("{} of {} objects not written: {}", failures.size(),
                                 entries.size(), fmt::join(failures, "; ")));
  return exit_code;
}

/// The summary, if one was asked for.
template <int Dim>
void SegmentCommand<Dim>::summarise(ExitCode exit_code, const ordered_json& entries) {
  clock_.end();
  if (arguments_.json.empty()) return;
  ordered_json out;
  out[program()] = SURFSEG_VERSION;
  out["config"] =
      dump_config(command_, {"help", "config", "json", "checkpoint", "resume", "memory"});
  out["exit_code"] = int(exit_code);
  out.update(entries);
  out["stages"] = clock_.to_json();
  out["time_s"] = clock_.total_seconds();
  out["peak_memory_mb"] = peak_memory_mb();
  write_json(arguments_.json, out);
}

template class SegmentCommand<2>;
template class SegmentCommand<3>;
template std::string step_line<2>(const std::string&, const surf::flow::StepRecord&, double);
template std::string step_line<3>(const std::string&, const surf::flow::StepRecord&, double);
template std::string conclusion_of<2>(const surf::segment::Result<2>&);
template std::string conclusion_of<3>(const surf::segment::Result<3>&);

}  // namespace surfseg
