// The verbs of surfseg. Each adds its subcommand to the parser; the callback runs it and
// throws on failure (main maps exceptions to exit codes). A command that ends with another
// code than 0 sets `exit_code`.
#pragma once

#include <string>
#include <vector>

#include "tools/common/cli_app.h"
#include "tools/common/exit_codes.h"

namespace surfseg {

void add_info_command(CLI::App& app, ExitCode& exit_code);
void add_phantom_command(CLI::App& app, ExitCode& exit_code);
void add_segment_command(CLI::App& app, ExitCode& exit_code);
/// Looks through the words after `surfseg segment` but for names of outputs: what can be found
/// wrong before anything is read.
/// @throws CLI::ParseError, surf::UsageError, surf::InputError  the last of a preset's file
void check_segment(std::vector<std::string> words);
void add_replay_command(CLI::App& app, ExitCode& exit_code);
void add_evaluate_command(CLI::App& app, ExitCode& exit_code);
void add_render_command(CLI::App& app, ExitCode& exit_code);
void add_batch_command(CLI::App& app, ExitCode& exit_code);
void add_studio_command(CLI::App& app, ExitCode& exit_code);

}  // namespace surfseg
