// NIfTI-1, NIfTI-2 and Analyze 7.5: .nii, .nii.gz, .hdr with .img.
#pragma once

#include <string>
#include <vector>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

/// See read_volume.
/// @throws InputError
Volume read_nifti(const std::string& path, const ReadOptions& options);
/// See volume_files.
/// @throws InputError
std::vector<std::string> nifti_files(const std::string& path);

}  // namespace surf::volume
