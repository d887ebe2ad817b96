#include "tools/common/command_line.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <map>

namespace surfseg {
namespace {

std::string quoted(const std::string& word) {
  const bool is_plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) || std::string("_@%+=:,./{}-").find(char(c)) != std::string::npos;
  });
  if (is_plain) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace

std::string command_line(const std::string& program, const CLI::App& command,
                         const std::vector<std::string>& skip) {
  std::string out = program + " " + command.get_name();
  std::map<const CLI::Option*, std::size_t> n_used;
  for (const CLI::Option* option : command.parse_order()) {
    const std::string name =
        option->get_lnames().empty() ? option->get_name() : option->get_lnames()[0];
    const std::size_t n = n_used[option]++;
    if (std::find(skip.begin(), skip.end(), name) != skip.end() || n >= option->results().size())
      continue;
    const std::string& value = option->results()[n];
    if (option->get_positional())
      out += " " + quoted(value);
    else if (option->get_items_expected_max() == 0)
      out += " --" + name;
    else
      out += " " + quoted(fmt::format("--{}={}", name, value));
  }
  return out;
}

}  // namespace surfseg
