// In place of dicom_segmentation.cpp where DCMTK is missing.
#include "libsurf/base/error.h"
#include "libsurf/volume/detail/dicom_segmentation.h"

namespace surf::volume {

bool has_dicom_writer() { return false; }

std::string dicom_segmentation_bytes(const std::string& path, const std::array<int, 3>&,
                                     const DicomOrigin&, std::span<const std::uint8_t>,
                                     std::span<const LabelName>) {
  throw OutputError(path + ": not written: this surfseg was built without DCMTK");
}

}  // namespace surf::volume
