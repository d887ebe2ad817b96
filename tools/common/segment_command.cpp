#include "tools/common/segment_command.h"

#include <fmt/format.h>

#include <map>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tools/common/config.h"
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

/// ", volume +- 12.3 mm^3, 1.2 % without an edge, next click at (...) mm"
template <int Dim>
std::string certainty_of(const surf::segment::Finished<Dim>& finished) {
  if (!finished.certainty) return "";
  const auto& certainty = *finished.certainty;
  std::string out = fmt::format(", {} +- {:.3g} mm^{}", Dim == 3 ? "volume" : "area",
                                certainty.content_deviation, Dim);
  if (certainty.share_without_edge > 0)
    out += fmt::format(", {:.2g} % without an edge", 100 * certainty.share_without_edge);
  return out;
}

}  // namespace

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
    : command_(command), arguments_(arguments), progress_(arguments.verbosity()) {}

template <int Dim>
surf::segment::ProgressOf<Dim> SegmentCommand<Dim>::on_step() {
  return [this](const std::string& stage, const surf::flow::StepRecord& record,
                const std::function<Shape()>& shape) {
    progress_.step(step_line<Dim>(stage, record, clock_.total_seconds()));
    if (record.n_elements > 0) show(shape);
    return signal_exit_code() == kDone;
  };
}

template <int Dim>
surf::segment::Result<Dim> SegmentCommand<Dim>::segment(const Input& input) {
  surf::segment::Segmentation<Dim> segmentation(input.setting);
  const int object = segmentation.add_object();
  segmentation.set_options(object, input.options);
  for (const auto& click : surf::segment::clicks_of(input.options))
    segmentation.add_click(object, click);
  Result result = segmentation.evolve(object, on_step());
  if (!arguments_.recipe.empty())
    surf::segment::write_recipe<Dim>(arguments_.recipe, segmentation, image_path());
  return result;
}

template <int Dim>
ExitCode SegmentCommand<Dim>::run() {
  check();
  std::unique_ptr<surf::ThreadLimit> limit;
  if (arguments_.threads > 0) limit = std::make_unique<surf::ThreadLimit>(arguments_.threads);
  clock_.begin("read");
  const Input input = read();
  for (const std::string& idle : idle_options()) progress_.note("note: " + idle);
  catch_signals();
  clock_.begin("segment");
  const Result result = segment(input);
  clock_.begin("verify");
  surf::segment::Finished<Dim> finished;
  try {
    finished = surf::segment::finish<Dim>(*input.setting, result, surf::extension(output()));
  } catch (const surf::NoObject& error) {
    const ExitCode code = signal_exit_code() == kDone ? kNoObject : signal_exit_code();
    summarise(result, nullptr, code);
    if (code != kNoObject) throw;
    throw surf::NoObject(fmt::format("{}: not written: {}", output(), error.what()));
  } catch (const surf::InvalidMesh& error) {
    finished.measures = input.setting->measures(result.shape);
    summarise(result, &finished.measures, kInvalidResult);
    throw surf::InvalidMesh(fmt::format("{}: not written: {}", output(), error.what()));
  }
  clock_.begin("write");
  write(input, result, finished);
  const ExitCode exit_code = exit_code_of(result.outcome);
  summarise(result, &finished.measures, exit_code);
  progress_.note(conclusion_of<Dim>(result));
  progress_.note(fmt::format("{}: {}{}, {:.2f} s", output(), describe(finished.measures),
                             certainty_of<Dim>(finished), clock_.total_seconds()));
  return exit_code;
}

/// Notes, and the summary if one was asked for.
template <int Dim>
void SegmentCommand<Dim>::summarise(const Result& result,
                                    const surf::segment::Measures<Dim>* measures,
                                    ExitCode exit_code) {
  clock_.end();
  for (const std::string& note : result.notes) progress_.note("note: " + note);
  if (result.border_share > 0)
    progress_.note(fmt::format("note: the {} ends at the border of the {} with {:.1f} % of its {}",
                               Dim == 3 ? "surface" : "curve", Dim == 3 ? "volume" : "image",
                               100 * result.border_share, Dim == 3 ? "area" : "length"));
  if (arguments_.json.empty()) return;
  ordered_json out;
  out[program()] = SURFSEG_VERSION;
  out["config"] = dump_config(command_, {"help", "config", "json"});
  out["exit_code"] = int(exit_code);
  out.update(ordered_json::parse(surf::segment::summary_json<Dim>(result, measures)));
  out["stages"] = clock_.stages();
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
