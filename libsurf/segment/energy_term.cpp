#include "libsurf/segment/energy_term.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::segment {
namespace {

const std::map<std::string, std::set<std::string>>& known_parameters() {
  static const std::map<std::string, std::set<std::string>> known = {
      {"minimal-surface", {"gamma0", "gamma", "lambda"}},
      {"chan-vese", {}},
      {"window", {"mean", "half-width"}},
      {"mumford-shah", {"mu", "gamma", "contrast", "data-tolerance"}},
      {"area", {}},
      {"volume", {}},
      {"anisotropic", {"x", "y", "z", "lambda"}},
      {"alignment", {"scale", "sign"}},
      {"willmore", {"curvature"}},
      {"prescribed-curvature", {"curvature", "lambda"}},
      {"average-edge", {"lambda"}},
      {"average-alignment", {"scale", "sign"}},
      {"region-competition", {}}};
  return known;
}

bool must_be_positive(const std::string& key) {
  static const std::set<std::string> keys = {"lambda", "half-width", "mu", "contrast",
                                             "scale",  "x",          "y",  "z"};
  return keys.contains(key);
}

void check_parameter(const EnergyTerm& term, const std::string& key, double value) {
  const auto refuse = [&](const char* what) {
    throw UsageError(fmt::format("energy {}: {} = {} {}", term.name, key, value, what));
  };
  if (!std::isfinite(value)) refuse("is not a number");
  if (must_be_positive(key) && !(value > 0)) refuse("violates > 0");
  if ((key == "data-tolerance" || (key == "gamma" && term.name == "mumford-shah")) && !(value >= 0))
    refuse("violates >= 0");
  if (key == "sign" && value != 1 && value != 0 && value != -1) refuse("is none of 1, 0, -1");
}

}  // namespace

double parameter(const EnergyTerm& term, const std::string& key) {
  const auto at = term.parameters.find(key);
  if (at == term.parameters.end())
    throw UsageError(fmt::format("energy {}: parameter {} is missing", term.name, key));
  return at->second;
}

std::string known_energies() {
  std::vector<std::string> names;
  for (const auto& [name, parameters] : known_parameters()) names.push_back(name);
  const std::string last = names.back();
  names.pop_back();
  return fmt::format("{} and {}", fmt::join(names, ", "), last);
}

bool has_mumford_shah(std::span<const EnergyTerm> terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const EnergyTerm& term) { return term.name == "mumford-shah"; });
}

bool settles_on_edges(std::span<const EnergyTerm> terms) {
  static const std::set<std::string> names = {"minimal-surface", "chan-vese", "window", "area",
                                              "volume"};
  return std::all_of(terms.begin(), terms.end(),
                     [](const EnergyTerm& term) { return names.contains(term.name); });
}

void check_terms(std::span<const EnergyTerm> terms) {
  for (const EnergyTerm& term : terms) {
    const auto known = known_parameters().find(term.name);
    if (known == known_parameters().end())
      throw UsageError(
          fmt::format("energy '{}' is unknown; there are {}", term.name, known_energies()));
    if (!std::isfinite(term.weight))
      throw UsageError(fmt::format("energy {}: weight {} is not a number", term.name, term.weight));
    for (const auto& [key, value] : term.parameters) {
      if (!known->second.contains(key))
        throw UsageError(fmt::format("energy {}: parameter '{}' is unknown", term.name, key));
      check_parameter(term, key, value);
    }
  }
}

}  // namespace surf::segment
