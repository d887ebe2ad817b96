// DICOM: the slices of a series in a folder, or one enhanced multi-frame file.
#pragma once

#include <string>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

/// See read_volume.
/// @throws InputError
Volume read_dicom(const std::string& path, const ReadOptions& options);

}  // namespace surf::volume
