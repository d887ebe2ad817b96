#include "libsurf/segment/energy_term.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "libsurf/base/error.h"

namespace surf::segment {
namespace {

const std::map<std::string, std::set<std::string>>& known_parameters() {
  static const std::map<std::string, std::set<std::string>> known = {
      {"minimal-surface", {"gamma0", "gamma", "lambda"}},
      {"chan-vese", {}},
      {"window", {"mean", "half-width"}},
      {"mumford-shah", {"mu", "gamma", "contrast", "data-tolerance"}},
      {"area", {}}};
  return known;
}

}  // namespace

double parameter(const EnergyTerm& term, const std::string& key) {
  const auto at = term.parameters.find(key);
  if (at == term.parameters.end())
    throw UsageError(fmt::format("energy {}: parameter {} is missing", term.name, key));
  return at->second;
}

void check_terms(std::span<const EnergyTerm> terms) {
  for (const EnergyTerm& term : terms) {
    const auto known = known_parameters().find(term.name);
    if (known == known_parameters().end())
      throw UsageError(fmt::format(
          "energy '{}' is unknown; there are minimal-surface, chan-vese, mumford-shah, window and "
          "area",
          term.name));
    if (!std::isfinite(term.weight))
      throw UsageError(fmt::format("energy {}: weight {} is not a number", term.name, term.weight));
    for (const auto& [key, value] : term.parameters) {
      if (!known->second.contains(key))
        throw UsageError(fmt::format("energy {}: parameter '{}' is unknown", term.name, key));
      if (!std::isfinite(value))
        throw UsageError(fmt::format("energy {}: {} = {} is not a number", term.name, key, value));
      if ((key == "lambda" || key == "half-width" || key == "mu" || key == "contrast") &&
          !(value > 0))
        throw UsageError(fmt::format("energy {}: {} = {} violates > 0", term.name, key, value));
      if ((key == "data-tolerance" || (key == "gamma" && term.name == "mumford-shah")) &&
          !(value >= 0))
        throw UsageError(fmt::format("energy {}: {} = {} violates >= 0", term.name, key, value));
    }
  }
}

}  // namespace surf::segment
