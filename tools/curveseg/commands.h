// The verbs of curveseg; see tools/surfseg/commands.h.
#pragma once

#include "tools/common/cli_app.h"
#include "tools/common/exit_codes.h"

namespace surfseg::curve_program {

void add_info_command(CLI::App& app, ExitCode& exit_code);
void add_phantom_command(CLI::App& app, ExitCode& exit_code);
void add_segment_command(CLI::App& app, ExitCode& exit_code);
void add_replay_command(CLI::App& app, ExitCode& exit_code);
void add_stack_command(CLI::App& app, ExitCode& exit_code);
void add_evaluate_command(CLI::App& app, ExitCode& exit_code);

}  // namespace surfseg::curve_program
