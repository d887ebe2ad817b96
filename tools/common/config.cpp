#include "tools/common/config.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/base/nearest_name.h"
#include "tools/common/report.h"

namespace surfseg {
namespace {

std::string to_argument(const std::string& path, const std::string& key,
                        const nlohmann::ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number() || value.is_boolean()) return value.dump();
  throw surf::UsageError(
      fmt::format("{}: '{}' is {}; expected a string, a number, true or false, or a list of them",
                  path, key, value.dump()));
}

/// What a run may write beside its -o.
bool is_beside_output(const std::string& key) {
  constexpr std::array kNames = {"mask",   "picture",  "thumbnail", "report",
                                 "recipe", "denoised", "start",     "frames"};
  return std::find(kNames.begin(), kNames.end(), key) != kNames.end();
}

CLI::Option* find_option(CLI::App& command, const std::string& path, const std::string& key) {
  CLI::Option* option = command.get_option_no_throw("--" + key);
  if (!option) option = command.get_option_no_throw(key);  // a positional argument
  if (!option || key == "help")
    throw surf::UsageError(fmt::format("{}: '{}' is not an option of {}{}", path,
                                       surf::one_line(key), command.get_name(),
                                       surf::did_you_mean(key, option_names(command))));
  return option;
}

}  // namespace

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> out;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) out.push_back(name);
  return out;
}

std::vector<std::string> apply_config(CLI::App& command, const std::string& path,
                                      const std::vector<std::string>& known) {
  std::vector<std::string> out;
  nlohmann::ordered_json document = read_json(path);
  const bool is_summary = document.contains("config");
  if (is_summary) document = document["config"];
  if (!document.is_object())
    throw surf::UsageError(fmt::format("{}: expected an object of options", path));
  const CLI::Option* output = command.get_option_no_throw("--output");
  const bool is_another_run = is_summary && output && output->count() > 0;
  for (const auto& [key, value] : document.items()) {
    if (key == "description") continue;  // of a preset
    if (is_another_run && is_beside_output(key)) continue;
    CLI::Option* option = find_option(command, path, key);
    out.push_back(key);
    if (option->count() > 0 || value.is_null()) continue;
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    // What a run was not told it has by itself; to be told it may not go together with the rest.
    if (is_summary && value.is_string() && value == option->get_default_str()) continue;
    if (value.is_array())
      for (const auto& item : value) option->add_result(to_argument(path, key, item));
    else
      option->add_result(to_argument(path, key, value));
    if (option->count() == 0) continue;
    try {
      option->run_callback();
    } catch (const CLI::ParseError& error) {
      throw surf::UsageError(
          fmt::format("{}: '{}' is {}: {}", path, key, value.dump(), surf::one_line(error.what())));
    }
  }
  return out;
}

nlohmann::ordered_json dump_config(const CLI::App& command, const std::vector<std::string>& skip) {
  nlohmann::ordered_json document = nlohmann::ordered_json::object();
  for (const CLI::Option* option : command.get_options()) {
    std::string name =
        option->get_lnames().empty() ? option->get_single_name() : option->get_lnames().front();
    if (std::find(skip.begin(), skip.end(), name) != skip.end()) continue;
    if (name == "preset") continue;  // what it sets is here itself
    if (option->count() == 0) {
      if (!option->get_default_str().empty()) document[name] = option->get_default_str();
      continue;
    }
    const auto results = option->results();
    if (option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll)
      document[name] = results;
    else
      document[name] = results.front();
  }
  return document;
}

}  // namespace surfseg
