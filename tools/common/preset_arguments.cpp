#include "tools/common/preset_arguments.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>

#include "libsurf/segment/presets.h"
#include "tools/common/config.h"
#include "tools/common/option_group.h"

namespace surfseg {
namespace {

void print_presets() {
  const auto presets = surf::segment::presets();
  std::size_t width = 0;
  for (const auto& preset : presets) width = std::max(width, preset.name.size());
  for (const auto& preset : presets)
    fmt::print("{:<{}}  {}\n", preset.name, width, preset.description);
  if (presets.empty()) fmt::print("no presets; SURFSEG_PRESETS names folders of them\n");
}

}  // namespace

void add_preset_option(CLI::App& command, std::string& preset, const std::string& group) {
  OptionGroup(command, group)
      .add("--preset", preset,
           "Options for one kind of structure by name, such as kidney-ct; list: what there "
           "is. The command line wins");
}

void apply_files(CLI::App& command, const std::string& config, const std::string& preset) {
  if (preset == "list") {
    print_presets();
    throw CLI::Success();
  }
  std::vector<std::string> known;
  if (!config.empty()) known = apply_config(command, config);
  if (!preset.empty()) apply_config(command, surf::segment::find_preset(preset).path, known);
}

}  // namespace surfseg
