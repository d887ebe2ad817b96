// Options for one kind of structure in one kind of scan, by name.
#pragma once

#include <string>
#include <vector>

namespace surf::segment {

struct Preset {
  std::string name;         ///< that of its file without .json
  std::string description;  ///< what it is for
  std::string path;         ///< a JSON object of options, and a "description"
};

/// Folders that presets are looked for in, the first one first: those of the environment variable
/// SURFSEG_PRESETS (apart by colons), then share/surfseg/presets beside the program or the library,
/// where `cmake --install` and the build put them.
std::vector<std::string> preset_folders();

/// All presets by name; of two with one name the one in the first folder counts.
/// @throws InputError  a preset is unreadable or no JSON object
std::vector<Preset> presets();

/// @throws UsageError  there is none of this name; the message has those that there are
/// @throws InputError  as presets()
Preset find_preset(const std::string& name);

}  // namespace surf::segment
