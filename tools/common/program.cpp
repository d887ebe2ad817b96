#include "tools/common/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/base/nearest_name.h"
#include "tools/common/config.h"
#include "tools/common/field_names.h"
#include "tools/common/heap.h"
#include "tools/common/say.h"
#include "tools/common/signals.h"

namespace surfseg {
namespace {

/// An option that the verb does not know and what it may have been meant to be; that is why others
/// are missing. Of several the first that is nearly one, or the first.
std::string mistyped_option(const CLI::App& verb) {
  const std::vector<std::string> known = option_names(verb);
  std::string first;
  for (const std::string& word : verb.remaining()) {
    const std::size_t begin = word.find_first_not_of('-');
    if (begin == 0 || begin == std::string::npos || !std::isalpha((unsigned char)word[begin]))
      continue;
    const std::string option = word.substr(0, word.find('='));
    if (const auto nearest = surf::nearest_name(option.substr(begin), known))
      return fmt::format("{} is not an option; did you mean '--{}'?", option, *nearest);
    if (first.empty()) first = fmt::format("{} is not an option", option);
  }
  return first;
}

/// The parser says of an unknown verb only that one is missing.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const auto verbs = app.get_subcommands();
  if (app.get_subcommands([](const CLI::App*) { return true; }).empty()) {
    const std::string mistyped = mistyped_option(app);
    return fmt::format("{} (see {} --help)", mistyped.empty() ? error.what() : mistyped,
                       app.get_name());
  }
  if (!verbs.empty()) {
    const std::string mistyped = mistyped_option(*verbs.front());
    return fmt::format("{} (see {} {} --help)", mistyped.empty() ? error.what() : mistyped,
                       app.get_name(), verbs.front()->get_name());
  }
  const std::vector<std::string> rest = app.remaining();
  if (rest.empty()) return fmt::format("{} (see {} --help)", error.what(), app.get_name());
  std::vector<std::string> known;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
    known.push_back(verb->get_name());
  return fmt::format("'{}' is neither a command nor an option{} (see {} --help)", rest.front(),
                     surf::did_you_mean(rest.front(), known), app.get_name());
}

/// @param result  "surface" or "contour"
std::string exit_code_help(const std::string& result) {
  return fmt::format(
      "Each subcommand has its own --help.\n\n"
      "Exit codes:\n"
      "  0         done\n"
      "  1         internal error: please report it\n"
      "  2         wrong option or argument\n"
      "  3         input that cannot be used\n"
      "  4         an output could not be written\n"
      "  5         stopped at a limit; the result was written\n"
      "  6         the {0} fails a guarantee and was not written\n"
      "  7         some cases of a batch, or of several objects, failed; the others were written\n"
      "  8         no object found, or it vanished; only summary and recipe were written\n"
      "  130, 143  interrupted, terminated; the last good {0} was written\n"
      "  152       the same at a limit of CPU time (ulimit -t)",
      result);
}

}  // namespace

Failure failure_of(const std::exception_ptr& error, const std::string& program) {
  const auto failure = [&](ExitCode code, std::string message) -> Failure {
    // One line, whatever a library's exception says.
    std::replace(message.begin(), message.end(), '\n', ' ');
    return {code, with_option_names(message, program)};
  };
  try {
    std::rethrow_exception(error);
  } catch (const CLI::ParseError& parse) {
    return failure(kUsage, parse.what());
  } catch (const surf::UsageError& usage) {
    return failure(kUsage, usage.what());
  } catch (const surf::InputError& input) {
    return failure(kInput, input.what());
  } catch (const surf::OutputError& output) {
    return failure(kOutput, output.what());
  } catch (const surf::NoObject& none) {
    const ExitCode code = signal_exit_code();
    return failure(code == kDone ? kNoObject : code, none.what());
  } catch (const surf::InvalidMesh& invalid) {
    return failure(kInvalidResult, invalid.what());
  } catch (const PartFailed& part) {
    return failure(kBatchFailed, part.what());
  } catch (const std::bad_alloc&) {
    return failure(kInput, "out of memory; crop the input or use a larger edge length");
  } catch (const std::system_error& none) {
    for (const int of_writing : {ENOSPC, EDQUOT, EFBIG, EIO, EPIPE})  // what is printed
      if (none.code() == std::error_code(of_writing, std::generic_category()) ||
          none.code() == std::error_code(of_writing, std::system_category()))
        return failure(kOutput, none.what());
    if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&none))
      return failure(kInput, fmt::format("{}: {}", file->path1().string(), file->code().message()));
    if (none.code() != std::errc::resource_unavailable_try_again)
      return failure(kInternal, none.what());
    return failure(
        kInput, "no thread can be started: out of memory or at a limit on processes (ulimit -a)");
  } catch (const std::exception& other) {
    return failure(kInternal, other.what());
  }
}

int run_program(const Program& program, int argc, char** argv) {
  ExitCode exit_code = kDone;
  CLI::App app{program.description, program.name};
  app.set_version_flag("--version", program.name + " " + program.version);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(exit_code_help(program.result));
  for (const auto add_verb : program.verbs) add_verb(app, exit_code);
  surf::set_log_sink([name = program.name](surf::LogLevel level, const std::string& message) {
    if (level == surf::LogLevel::kWarning)
      say("{}: warning: {}\n", name, with_option_names(message, name));
  });
  return run_guarded(app, [&] {
    app.parse(argc, argv);
    return exit_code;
  });
}

namespace {

/// What was printed, where the disk of its file is full.
bool is_printed() {
  std::cout.flush();
  return std::fflush(stdout) == 0 && !std::ferror(stdout) && std::cout.good();
}

/// A file that is opened would take the number of standard error, and warnings would be written
/// into it.
void take_the_numbers_of_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) == -1 && errno == EBADF)
      (void)!::open("/dev/null", O_RDONLY);  // the least number that is free; writing still fails
}

}  // namespace

int run_guarded(CLI::App& app, const std::function<ExitCode()>& work,
                const std::function<std::string(const std::string&)>& reworded) {
  keep_freed_memory();
  take_the_numbers_of_closed_streams();
  take_file_limits_as_errors();
  const std::string& name = app.get_name();
  const auto fail = [&](const Failure& failure) -> int {
    say("{}: error: {}\n", name, reworded ? reworded(failure.message) : failure.message);
    return failure.exit_code;
  };
  int code = kDone;
  try {
    code = work();
  } catch (const Listing& list) {
    std::fwrite(list.text.data(), 1, list.text.size(), stdout);
  } catch (const CLI::Success& help_or_version) {
    code = app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    return fail({kUsage, with_option_names(usage_message(app, error), name)});
  } catch (...) {
    return fail(failure_of(std::current_exception(), name));
  }
  if (is_printed() || code != kDone) return code;
  return fail({kOutput, fmt::format("standard output cannot be written: {}",
                                    errno ? std::strerror(errno) : "what came before could not")});
}

}  // namespace surfseg
