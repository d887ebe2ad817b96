// In place of dicom_segmentation.cpp where DCMTK is missing.
#include "libsurf/volume/detail/dicom_segmentation.h"

namespace surf::volume {

extern "C" {
std::string (*const surf_dicom_segmentation)(const std::string&, const std::array<int, 3>&,
                                             const DicomOrigin&, std::span<const std::uint8_t>,
                                             std::span<const LabelName>) = nullptr;
}

}  // namespace surf::volume
