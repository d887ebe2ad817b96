// The verbs of curveseg; see tools/surfseg/commands.h.
#pragma once

#include <CLI/CLI.hpp>

#include "libsurf/segment/measures.h"
#include "tools/common/exit_codes.h"

namespace surfseg::curve_program {

void add_info_command(CLI::App& app, ExitCode& exit_code);
void add_phantom_command(CLI::App& app, ExitCode& exit_code);
void add_segment_command(CLI::App& app, ExitCode& exit_code);
void add_replay_command(CLI::App& app, ExitCode& exit_code);
void add_stack_command(CLI::App& app, ExitCode& exit_code);
void add_evaluate_command(CLI::App& app, ExitCode& exit_code);

/// "96 elements, 1 regions, ...", of curves that were verified.
std::string describe_curves(const surf::segment::Measures<2>& measures);

}  // namespace surfseg::curve_program
