#include "tools/common/program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"

namespace surfseg {
namespace {

/// The parser says of an unknown verb only that one is missing.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const auto verbs = app.get_subcommands();
  if (!verbs.empty())
    return fmt::format("{} (see {} {} --help)", error.what(), app.get_name(),
                       verbs.front()->get_name());
  const std::vector<std::string> rest = app.remaining();
  if (!rest.empty())
    return fmt::format("'{}' is neither a command nor an option (see {} --help)", rest.front(),
                       app.get_name());
  return fmt::format("{} (see {} --help)", error.what(), app.get_name());
}

}  // namespace

int run_program(CLI::App& app, int argc, char** argv, const ExitCode& exit_code) {
  const std::string name = app.get_name();
  surf::set_log_sink([name](surf::LogLevel level, const std::string& message) {
    if (level == surf::LogLevel::kWarning) fmt::print(stderr, "{}: warning: {}\n", name, message);
  });
  const auto fail = [&](ExitCode code, std::string message) -> int {
    // One line, whatever a library's exception says.
    std::replace(message.begin(), message.end(), '\n', ' ');
    fmt::print(stderr, "{}: error: {}\n", name, message);
    return code;
  };
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const Listing& list) {
    fmt::print("{}", list.text);
    return kDone;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    return fail(kUsage, usage_message(app, error));
  } catch (const surf::UsageError& error) {
    return fail(kUsage, error.what());
  } catch (const surf::InputError& error) {
    return fail(kInput, error.what());
  } catch (const surf::OutputError& error) {
    return fail(kOutput, error.what());
  } catch (const surf::InvalidMesh& error) {
    return fail(kInvalidResult, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kInput, "out of memory; crop the input or use a larger edge length");
  } catch (const std::exception& error) {
    return fail(kInternal, error.what());
  }
}

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
      "  7         some cases of a batch failed\n"
      "  130, 143  interrupted, terminated; the last good {0} was written",
      result);
}

}  // namespace surfseg
