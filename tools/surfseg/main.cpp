// surfseg: surfaces from CT and MRI volumes. Parses, dispatches, maps errors to exit codes.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "tools/surfseg/commands.h"

namespace {

constexpr const char* kFooter =
    "Each subcommand has its own --help.\n\n"
    "Exit codes:\n"
    "  0         done\n"
    "  1         internal error: please report it\n"
    "  2         wrong option or argument\n"
    "  3         input that cannot be used\n"
    "  4         an output could not be written\n"
    "  5         stopped at a limit; the result was written\n"
    "  6         the surface fails a guarantee and was not written\n"
    "  7         some cases of a batch failed\n"
    "  130, 143  interrupted, terminated; the last good surface was written";

/// One line, whatever a library's exception says.
int fail(surfseg::ExitCode code, std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "surfseg: error: {}\n", message);
  return code;
}

/// The parser says of an unknown verb only that one is missing.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const auto verbs = app.get_subcommands();
  if (!verbs.empty())
    return fmt::format("{} (see surfseg {} --help)", error.what(), verbs.front()->get_name());
  const std::vector<std::string> rest = app.remaining();
  if (!rest.empty())
    return fmt::format("'{}' is neither a command nor an option (see surfseg --help)",
                       rest.front());
  return fmt::format("{} (see surfseg --help)", error.what());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace surfseg;
  surf::set_log_sink([](surf::LogLevel level, const std::string& message) {
    if (level == surf::LogLevel::kWarning) fmt::print(stderr, "surfseg: warning: {}\n", message);
  });

  ExitCode exit_code = kDone;
  CLI::App app{"Turn a CT or MRI volume into a closed, manifold, sub-voxel surface mesh.",
               "surfseg"};
  app.set_version_flag("--version", "surfseg " SURFSEG_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(kFooter);
  add_info_command(app, exit_code);
  add_segment_command(app, exit_code);
  add_phantom_command(app, exit_code);
  add_evaluate_command(app, exit_code);
  add_render_command(app, exit_code);

  try {
    app.parse(argc, argv);
    return exit_code;
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
    return fail(kInput, "out of memory; crop the volume or use a larger edge length");
  } catch (const std::exception& error) {
    return fail(kInternal, error.what());
  }
}
