// VTK XML image data: .vti.
#pragma once

#include <string>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

/// See read_volume.
/// @throws InputError
Volume read_vti(const std::string& path, const ReadOptions& options);

}  // namespace surf::volume
