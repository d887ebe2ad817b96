// The parameters of surfseg-slicer: one table for its description in XML and for its parser.
#pragma once

#include <string>
#include <vector>

namespace surfseg::slicer {

enum class Kind {
  kVolume,       ///< the input, which has no flag
  kPoints,       ///< X,Y,Z in LPS mm, once for each point
  kPointFile,    ///< Slicer's .mrk.json or .fcsv
  kSurface,      ///< a surface to write
  kLabels,       ///< a label map to write
  kText,         ///< passed only where it is not empty
  kNumber,       ///< always passed
  kChoice,       ///< always passed
  kFlag,         ///< passed where it is true, without a value
  kGivenNumber,  /// what the program gives back
  kGivenText
};

struct Parameter {
  Kind kind;
  std::string name;  ///< the flag is --name
  std::string label, description;
  /// The option of `surfseg segment` that it stands for; "" if the program itself sees to it.
  std::string option = {};
  std::string standard = {};              ///< what a window shows at first
  std::vector<std::string> choices = {};  ///< of kChoice
};

/// A group of a window.
struct Group {
  std::string label, description;
  bool is_advanced;  ///< closed at first
  std::vector<Parameter> parameters;
};

/// @throws surf::InputError  a preset is unreadable
std::vector<Group> parameter_groups();

/// All of them in their order.
std::vector<Parameter> parameters_of(const std::vector<Group>& groups);

/// A number or text that is given back, not passed.
bool is_given_back(const Parameter& parameter);
/// The name with its dashes.
std::string flag_of(const Parameter& parameter);

}  // namespace surfseg::slicer
