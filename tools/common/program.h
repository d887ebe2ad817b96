// What every program's main does: parse, run the verb, map errors to exit codes.
#pragma once

#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tools/common/cli_app.h"
#include "tools/common/exit_codes.h"

namespace surfseg {

/// Thrown where a list is asked for in place of a run: it is printed, and the exit code is 0.
struct Listing {
  std::string text;
};

/// Some of several results could not be written: exit code 7.
struct PartFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What differs from program to program.
struct Program {
  std::string name, version, description;
  std::string result;  ///< what it makes: "surface", "contour"
  /// Each adds its subcommand; see commands.h.
  std::vector<void (*)(CLI::App& app, ExitCode& exit_code)> verbs;
};

/// What a program says of an exception, and what it ends with.
struct Failure {
  ExitCode exit_code;
  std::string message;  ///< one line, with the names of options
};
Failure failure_of(const std::exception_ptr& error, const std::string& program);

/// Parses the command line, whose callbacks run the verbs, and returns the exit code. An error is
/// one line on stderr that begins with the program's name.
int run_program(const Program& program, int argc, char** argv);

/// Does `work` and returns its exit code, or that of what it throws; an error is one line on stderr
/// that begins with the parser's name.
/// @param reworded  the line as it is to be printed, after fields have become options
int run_guarded(CLI::App& app, const std::function<ExitCode()>& work,
                const std::function<std::string(const std::string&)>& reworded = {});

}  // namespace surfseg
