// What every program's main does: parse, run the verb, map errors to exit codes.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/common/exit_codes.h"

namespace surfseg {

/// Thrown where a list is asked for in place of a run: it is printed, and the exit code is 0.
struct Listing {
  std::string text;
};

/// Parses the command line, whose callbacks run the verbs, and returns the exit code. An error is
/// one line on stderr that begins with the program's name.
/// @param exit_code  what verbs set if they end well or at a limit
int run_program(CLI::App& app, int argc, char** argv, const ExitCode& exit_code);

/// The list of exit codes for the help.
/// @param result  "surface" or "contour"
std::string exit_code_help(const std::string& result);

}  // namespace surfseg
