#include "tools/common/profile.h"

#include <fmt/format.h>

namespace surfseg {
namespace {

std::string line(const std::string& name, const surf::Resources& used, double total,
                 std::size_t n_steps = 0) {
  const std::string steps =
      n_steps == 0 ? ""
                   : fmt::format("{:7} {:9.1f}", n_steps, 1000 * used.seconds / double(n_steps));
  return fmt::format("{:<24} {:8.2f} {:8.2f} {:6.0f} % {:8.0f} {}", name, used.seconds,
                     used.cpu_seconds, 100 * used.seconds / std::max(total, 1e-9),
                     used.peak_memory_mb, steps);
}

}  // namespace

std::vector<std::string> profile_lines(const StageClock& clock,
                                       const std::vector<ObjectStages>& objects) {
  const surf::Resources all = clock.total();
  std::vector<std::string> out = {fmt::format("{:<24} {:>8} {:>8} {:>8} {:>8} {:>7} {:>9}",
                                              "profile", "wall s", "CPU s", "share", "peak MB",
                                              "steps", "ms/step")};
  for (const auto& [name, used] : clock.stages()) {
    out.push_back(line(name, used, all.seconds));
    if (name != "segment") continue;
    for (const auto& [object, stages] : objects)
      for (const surf::segment::StageReport& stage : stages)
        out.push_back(line("  " + (object.empty() ? "" : object + ": ") + stage.name, stage.used,
                           all.seconds, stage.flow.steps.size()));
  }
  out.push_back(line("in all", all, all.seconds));
  return out;
}

}  // namespace surfseg
