// Energy terms as text: NAME[:key=value,...].
#pragma once

#include <string>

#include "libsurf/segment/energy_term.h"

namespace surfseg {

/// "window:mean=380,half-width=150,weight=2"; the weight is 1 unless given.
/// @throws surf::UsageError
surf::segment::EnergyTerm parse_energy_term(const std::string& option, const std::string& text);

/// The text that parses to the same term.
std::string to_string(const surf::segment::EnergyTerm& term);

/// @throws surf::UsageError  not a finite number
double parse_number(const std::string& option, const std::string& text);

}  // namespace surfseg
