#include "tools/slicer/cli/points_command.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>

#include "libsurf/base/file.h"
#include "libsurf/segment/segment.h"
#include "tools/common/arguments.h"
#include "tools/common/preset_arguments.h"

namespace surfseg::slicer {

SegmentOptions::SegmentOptions(std::vector<std::string> words) {
  command_.set_help_flag();
  add_start_options(command_, run_, kVolumeWords);
  add_run_options(command_, run_, kVolumeWords);
  add_running_options(command_, run_);
  std::reverse(words.begin(), words.end());  // as the parser wants them
  command_.parse(std::move(words));
  apply_files(command_, "", run_.preset);
  run_.quiet = true;  // the host takes all that is on stderr for errors
}

void PointsCommand::check() const {
  check_run_arguments(command(), options_.run(), kVolumeWords);
  for (const std::string& point : options_.run().seeds) parse_point("--seed", point);
  for (const std::string& point : options_.run().outside) parse_point("--outside", point);
}

PointsCommand::Input PointsCommand::read() {
  tags_.start("reading the volume");
  auto setting = open(files().volume);
  surf::segment::Options<3> out;
  const auto ras_mm = [&](const std::string& option, const std::string& point) {
    return to_ras_mm(parse_point(option, point), Space::kLps, image().index_to_world());
  };
  for (const std::string& point : options_.run().seeds)
    out.seeds_mm.push_back(ras_mm("--seed", point));
  for (const std::string& point : options_.run().outside)
    out.outside_mm.push_back(ras_mm("--outside", point));
  set_run_options<3>(command(), options_.run(), image().voxel_size(), out);
  return {std::move(setting), objects_of<3>(command(), options_.run(), out)};
}

void PointsCommand::tell(const std::string& stage, const surf::flow::StepRecord& record) {
  tags_.step(record.n_elements == 0
                 ? fmt::format("{}, step {}", stage, record.k)
                 : fmt::format("{}, step {}: {:.4g} ml", stage, record.k, record.enclosed / 1000));
}

/// Of a label map alone the surface is not rounded, as for a file with all digits.
std::string PointsCommand::output() const {
  return files().output.empty() ? "the surface" : files().output;
}

void PointsCommand::write(const surf::segment::Object<3>& object,
                          const surf::segment::Finished<3>& finished) const {
  if (!files().output.empty()) SurfaceCommand::write(object, finished);
  give_back(*object.result, finished.measures);
}

void PointsCommand::give_back(const surf::segment::Result<3>& result,
                              const surf::segment::Measures<3>& measures) const {
  const std::vector<std::pair<std::string, std::string>> values = {
      {"volume_ml", fmt::format("{:.5g}", measures.content / 1000)},
      {"area_cm2", fmt::format("{:.5g}", measures.measure / 100)},
      {"verdict", result.verdict ? result.verdict->text() : to_string(result.outcome)}};
  std::string lines;
  for (const auto& [name, value] : values) {
    tags_.result(name, value);
    lines += fmt::format("{} = {}\n", name, value);
  }
  if (!return_file_.empty()) surf::write_bytes(return_file_, lines);
}

}  // namespace surfseg::slicer
