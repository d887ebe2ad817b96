// Options from a JSON file: any option of a command by its long name without dashes.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/common/cli_app.h"

namespace surfseg {

/// The long names of a command's options, without dashes.
std::vector<std::string> option_names(const CLI::App& command);

/// Gives every option of `command` that the command line did not set the value the document
/// has for it, as if it had been typed. A summary's "config" object is taken if there is one;
/// of another -o than its own, without the other files that its run wrote.
/// @throws surf::UsageError  unknown option, or a value that is no string, number, boolean
///                           or list of them
/// @throws surf::InputError  the file cannot be read
/// @param known  options that another document had, and that are left alone
/// @return  those that this one has
std::vector<std::string> apply_config(CLI::App& command, const std::string& path,
                                      const std::vector<std::string>& known = {});

/// Every option of `command` with its value (given or default), except `skip`.
nlohmann::ordered_json dump_config(const CLI::App& command, const std::vector<std::string>& skip);

}  // namespace surfseg
