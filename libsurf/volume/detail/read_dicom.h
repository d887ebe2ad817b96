// DICOM: the slices of a series in a folder, or one enhanced multi-frame file; in the library
// surf_dicom.
#pragma once

#include <string>
#include <vector>

#include "libsurf/volume/read_volume.h"

namespace surf::volume {

extern "C" {
/// See read_volume.
/// @throws InputError
extern Volume (*const surf_read_dicom)(const std::string& path, const ReadOptions& options);
/// See is_dicom_image.
/// @throws InputError
extern bool (*const surf_is_dicom_image)(const std::string& path);
/// See dicom_series.
extern std::vector<DicomSeries> (*const surf_dicom_series)(const std::string& folder);
}

}  // namespace surf::volume
