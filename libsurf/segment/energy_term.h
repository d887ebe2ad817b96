// One term of an energy, and its text.
#pragma once

#include <map>
#include <string>

namespace surf::segment {

/// One term of the energy with its parameters by name; what is not given is chosen from the image
/// round the seeds. Names, parameters, units and defaults are those of the table of energy kinds
/// (energy_kind.h).
struct EnergyTerm {
  std::string name;
  double weight = 1;
  std::map<std::string, double> parameters;

  bool operator==(const EnergyTerm&) const = default;
};

/// @throws UsageError  it is missing
double parameter(const EnergyTerm& term, const std::string& key);

/// "window:mean=380,half-width=150,weight=2"; the weight is 1 unless given. Whether there are such
/// a kind and such parameters is for check_terms to say.
/// @throws UsageError  the text is not of this form, a key is given twice
EnergyTerm parse_term(const std::string& text);

/// The text that parses to the same term, every number to its last bit.
std::string to_string(const EnergyTerm& term);

}  // namespace surf::segment
