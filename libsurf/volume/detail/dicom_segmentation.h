// DICOM Segmentation objects; in the library surf_dicom.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "libsurf/volume/volume.h"
#include "libsurf/volume/write_volume.h"

namespace surf::volume {

extern "C" {
/// Null without DCMTK. The bytes of a binary segmentation: for each label a segment with its name
/// and colour, of which there is a frame for each slice of the series that it is in.
/// @param names  of the labels; at least one
/// @throws OutputError  no voxel has a label; DCMTK refuses something
extern std::string (*const surf_dicom_segmentation)(const std::string& path,
                                                    const std::array<int, 3>& size,
                                                    const DicomOrigin& origin,
                                                    std::span<const std::uint8_t> labels,
                                                    std::span<const LabelName> names);
}

}  // namespace surf::volume
