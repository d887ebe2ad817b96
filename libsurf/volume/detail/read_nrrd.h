// NRRD: .nrrd, and .nhdr with its data file.
#pragma once

#include <string>
#include <vector>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

/// See read_volume.
/// @throws InputError
Volume read_nrrd(const std::string& path, const ReadOptions& options);
/// See volume_files.
/// @throws InputError
std::vector<std::string> nrrd_files(const std::string& path);

}  // namespace surf::volume
