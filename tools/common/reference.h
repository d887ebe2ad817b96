// What a surface is compared with: a mesh or a label map.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "tools/common/surface_scores.h"
#include "tools/common/volume_arguments.h"

namespace surfseg {

/// A mesh to compare.
/// @param unstated_space  if its header states none: "ras" or "lps"
/// @throws surf::InputError  cannot be read, or has no area
surf::Triangles read_compared(const std::string& path, const std::string& unstated_space);

/// To the log.
void warn_in_log(const std::string& message);

/// A mesh by its name's ending, else a label map.
/// @param unstated_space  of a mesh whose header states none: "ras" or "lps"
/// @param warn            is told that a volume looks like none of labels
/// @throws surf::UsageError  a label, frame or series of a mesh
/// @throws surf::InputError  cannot be read, or has no area
Reference read_reference(const std::string& path, const std::optional<int>& label,
                         const VolumeArguments& which, const std::string& unstated_space,
                         const std::function<void(const std::string&)>& warn = warn_in_log);

}  // namespace surfseg
