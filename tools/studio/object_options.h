// The options of an object that the page shows, and how each is read and set.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libsurf/segment/options.h"

namespace surfseg::studio {

struct ObjectOption {
  std::string key, label, group, unit;
  std::string type;  ///< "number", "integer", "boolean", "choice", "energies"
  std::string help;  ///< one line
  std::vector<std::string> choices = {};
  double minimum = 0;
  std::function<nlohmann::ordered_json(const surf::segment::Options<3>&)> get;
  /// Null = what holds where nothing is set.
  std::function<void(surf::segment::Options<3>&, const nlohmann::ordered_json&)> set;
};

const std::vector<ObjectOption>& object_options();

/// Those that differ from what holds where nothing is set.
nlohmann::ordered_json options_to_json(const surf::segment::Options<3>& options);

/// Sets those that the object has, null for what holds where nothing is set.
/// @throws surf::UsageError  an unknown key, a value of another type
void change_options(surf::segment::Options<3>& options, const nlohmann::ordered_json& changes);

/// Those of a preset, on the object that has these: where it lies and what it starts from stay.
surf::segment::Options<3> with_preset(const surf::segment::Options<3>& options,
                                      surf::segment::Options<3> preset);

/// All that may be set: options, energies, presets, formats of files; docs/studio-protocol.md.
nlohmann::ordered_json describe_options();

}  // namespace surfseg::studio
