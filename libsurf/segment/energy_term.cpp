#include "libsurf/segment/energy_term.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "libsurf/base/error.h"

namespace surf::segment {
namespace {

double parse_value(const std::string& name, const std::string& key, const std::string& text) {
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw UsageError(fmt::format("energy {}: {}: expected a number; got '{}'", name, key, text));
  return value;
}

}  // namespace

double parameter(const EnergyTerm& term, const std::string& key) {
  const auto at = term.parameters.find(key);
  if (at == term.parameters.end())
    throw UsageError(fmt::format("energy {}: parameter {} is missing", term.name, key));
  return at->second;
}

EnergyTerm parse_term(const std::string& text) {
  EnergyTerm term;
  const std::size_t colon = text.find(':');
  term.name = text.substr(0, colon);
  if (colon == std::string::npos) return term;
  std::map<std::string, double> values;
  std::istringstream stream(text.substr(colon + 1));
  for (std::string item; std::getline(stream, item, ',');) {
    const std::size_t equal = item.find('=');
    if (equal == std::string::npos)
      throw UsageError(fmt::format("energy {}: expected key=value; got '{}'", term.name, item));
    const std::string key = item.substr(0, equal);
    const double value = parse_value(term.name, key, item.substr(equal + 1));
    if (!values.emplace(key, value).second)
      throw UsageError(fmt::format("energy {}: {} is given twice", term.name, key));
  }
  if (const auto weight = values.extract("weight")) term.weight = weight.mapped();
  term.parameters = std::move(values);
  return term;
}

std::string to_string(const EnergyTerm& term) {
  std::string text = term.name;
  char separator = ':';
  const auto append = [&](const std::string& key, double value) {
    text += fmt::format("{}{}={}", separator, key, value);  // the shortest that is read back
    separator = ',';
  };
  for (const auto& [key, value] : term.parameters) append(key, value);
  if (term.weight != 1) append("weight", term.weight);
  return text;
}

}  // namespace surf::segment
