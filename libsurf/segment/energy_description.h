// The table of energy kinds for people and for programs.
#pragma once

#include <string>

namespace surf::segment {

/// Plain text: each kind with its formula, a sentence, and its parameters with unit, range and
/// default.
template <int Dim>
std::string describe_energies();

/// JSON: a list of objects with name, formula, description, settles_on_edges, denoises and
/// parameters; of these key, unit, meaning, range (text, lowest, highest, excludes_lowest or
/// values), default (null where it is chosen or absent), default_text, is_optional and
/// blur_power.
template <int Dim>
std::string energies_as_json();

/// The parameters of all kinds of both dimensions as a Markdown table, for docs/energies.md.
std::string parameters_as_markdown();

}  // namespace surf::segment
