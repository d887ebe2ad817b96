// Options from files: --config FILE and --preset NAME.
#pragma once

#include <string>

#include "tools/common/cli_app.h"

namespace surfseg {

void add_preset_option(CLI::App& command, std::string& preset, const std::string& group);

/// Gives every option that the command line does not set the value that the file `config` has for
/// it, then the one that the preset has; either may be empty. A config that names a preset counts
/// as --preset. For "list" the presets are printed and the program ends well.
/// @throws surf::UsageError, surf::InputError
/// @throws CLI::Success  after the list
void apply_files(CLI::App& command, const std::string& config, const std::string& preset);

}  // namespace surfseg
