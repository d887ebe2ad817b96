// Files that a person takes home from the studio.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "libsurf/base/error.h"
#include "tools/studio/dialogue.h"

namespace surfseg::studio {

struct Export {
  std::string what;    ///< "surface", "labels", "measures", "picture", "report", "recipe"
  int object = 0;      ///< 0 = all, where that makes sense
  std::string format;  ///< "stl", ...; "" = as the name ends
  std::string space = "lps";
  std::string name;  ///< of the file; "" = of object or volume
  bool may_overwrite = false;
};

struct Exported {
  std::string name;
  std::uintmax_t bytes = 0;
};

/// The file is there, and was not to be overwritten.
class FileExists : public surf::UsageError {
 public:
  using UsageError::UsageError;
};

/// Into the dialogue's folder, the bytes that `surfseg replay` writes: finished together with the
/// objects before it, so that none overlaps another.
/// @throws FileExists, surf::Error
Exported export_file(const Dialogue& dialogue, const Export& wanted);

/// "surfseg replay ... -o ...": what a shell takes to make the object's surface again.
/// @param id  0 = all objects
/// @throws surf::UsageError  there is no volume or no such object
std::string replay_command(const State& state, int id);

}  // namespace surfseg::studio
