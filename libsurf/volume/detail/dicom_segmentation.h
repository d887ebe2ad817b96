// DICOM Segmentation objects; private to volume/*.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "libsurf/volume/volume.h"
#include "libsurf/volume/write_volume.h"

namespace surf::volume {

/// True if this library can write DICOM, which DCMTK does.
bool has_dicom_writer();

/// The bytes of a binary segmentation: for each label a segment with its name and colour, of which
/// there is a frame for each slice of the series that it is in.
/// @param names  of the labels; at least one
/// @throws OutputError  no voxel has a label; DCMTK refuses something; it was not there to build
std::string dicom_segmentation_bytes(const std::string& path, const std::array<int, 3>& size,
                                     const DicomOrigin& origin,
                                     std::span<const std::uint8_t> labels,
                                     std::span<const LabelName> names);

}  // namespace surf::volume
