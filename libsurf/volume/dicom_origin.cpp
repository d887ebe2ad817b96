#include "libsurf/volume/dicom_origin.h"

#include <fmt/format.h>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/volume/detail/dicom_segmentation.h"
#include "libsurf/volume/volume.h"

namespace surf::volume {
namespace {

/// The name of a UID that the series lacks, "" if it has all.
std::string missing_uid(const DicomOrigin& origin) {
  if (origin.value(0x0020, 0x000d).empty()) return "StudyInstanceUID";
  if (origin.series_uid.empty()) return "SeriesInstanceUID";
  if (origin.value(0x0020, 0x0052).empty()) return "FrameOfReferenceUID";
  for (const DicomImage& image : origin.images) {
    if (image.sop_class_uid.empty()) return "SOPClassUID";
    if (image.sop_instance_uid.empty()) return "SOPInstanceUID";
  }
  return {};
}

}  // namespace

std::string DicomOrigin::value(std::uint16_t group, std::uint16_t element) const {
  for (const DicomAttribute& attribute : attributes)
    if (attribute.group == group && attribute.element == element) return attribute.value;
  return {};
}

void check_dicom_output(const std::string& path, const Volume& volume) {
  if (extension(path) != ".dcm") return;
  if (!SURF_LATE(surf_dicom, surf_dicom_segmentation))
    throw OutputError(fmt::format(
        "{}: this surfseg was built without DCMTK, which writes DICOM; choose another format, or "
        "build it where libdcmtk-dev is",
        path));
  if (!volume.dicom())
    throw InputError(fmt::format(
        "{}: a DICOM object belongs to a patient and refers to the images it was made of, which {} "
        "does not tell; give the DICOM series, or write another format",
        path, volume.source().path.empty() ? "the volume" : volume.source().path));
  if (const std::string uid = missing_uid(*volume.dicom()); !uid.empty())
    throw InputError(
        fmt::format("{}: the series of {} has no {}, to which a DICOM object refers; "
                    "write another format",
                    path, volume.source().path, uid));
}

}  // namespace surf::volume
