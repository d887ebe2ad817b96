// surfseg studio in a program that was built without it.
#include <CLI/App.hpp>

#include "libsurf/base/error.h"
#include "tools/surfseg/commands.h"

namespace surfseg {

void add_studio_command(CLI::App& app, ExitCode&) {
  CLI::App* command =
      app.add_subcommand("studio", "Click in a browser (not in this build: see its message)");
  command->allow_extras();
  command->callback([] {
    throw surf::UsageError(
        "this program was built without the studio: install libcpp-httplib-dev, nodejs and npm "
        "(tools/setup.sh does) and build again");
  });
}

}  // namespace surfseg
