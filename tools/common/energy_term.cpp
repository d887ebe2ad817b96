#include "tools/common/energy_term.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "libsurf/base/error.h"

namespace surfseg {

double parse_number(const std::string& option, const std::string& text) {
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw surf::UsageError(fmt::format("{}: expected a number; got '{}'", option, text));
  return value;
}

surf::segment::EnergyTerm parse_energy_term(const std::string& option, const std::string& text) {
  surf::segment::EnergyTerm term;
  const std::size_t colon = text.find(':');
  term.name = text.substr(0, colon);
  if (colon == std::string::npos) return term;
  std::istringstream stream(text.substr(colon + 1));
  for (std::string item; std::getline(stream, item, ',');) {
    const std::size_t equal = item.find('=');
    if (equal == std::string::npos)
      throw surf::UsageError(
          fmt::format("{}: expected key=value after '{}:'; got '{}'", option, term.name, item));
    const std::string key = item.substr(0, equal);
    const double value = parse_number(option + " " + key, item.substr(equal + 1));
    if (key == "weight")
      term.weight = value;
    else
      term.parameters[key] = value;
  }
  return term;
}

std::string to_string(const surf::segment::EnergyTerm& term) {
  std::string text = term.name;
  char separator = ':';
  const auto append = [&](const std::string& key, double value) {
    text += fmt::format("{}{}={}", separator, key, value);
    separator = ',';
  };
  for (const auto& [key, value] : term.parameters) append(key, value);
  if (term.weight != 1) append("weight", term.weight);
  return text;
}

}  // namespace surfseg
