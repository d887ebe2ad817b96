// A verb of a program that has options of a run.
#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>

#include "tools/common/exit_codes.h"
#include "tools/common/preset_arguments.h"

namespace surfseg {

/// What the help says of a verb.
struct VerbText {
  std::string name, description;
  std::string footer;  ///< examples, exit codes
};

/// Adds a subcommand that reads --config and --preset and ends with Command(command, typed).run().
/// @param add_options  adds the options, for RunArguments and what else the command is made from
template <class Command, class Arguments>
void add_verb(CLI::App& app, ExitCode& exit_code, const VerbText& text,
              void (*add_options)(CLI::App& command, Arguments& typed)) {
  const auto typed = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(text.name, text.description);
  add_options(*command, *typed);
  command->footer(text.footer);
  command->callback([command, typed, &exit_code] {
    apply_files(*command, typed->config, typed->preset);
    exit_code = Command(*command, *typed).run();
  });
}

}  // namespace surfseg
