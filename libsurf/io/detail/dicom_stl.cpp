#include "libsurf/io/detail/dicom_stl.h"

#include <fmt/format.h>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"
#include "libsurf/io/detail/stl_file.h"
#include "libsurf/volume/detail/dicom_object.h"

namespace surf::io {
namespace {

/// The images that the series has, each once: those of several frames name their file.
std::vector<volume::DicomImage> instances(const volume::DicomOrigin& origin) {
  std::vector<volume::DicomImage> out;
  for (const volume::DicomImage& image : origin.images)
    if (out.empty() || out.back().sop_instance_uid != image.sop_instance_uid) out.push_back(image);
  return out;
}

void insert_text(DcmItem& data, const DcmTagKey& tag, const std::string& value) {
  data.putAndInsertString(DcmTag(tag), value.c_str());
}

/// SourceInstanceSequence, which is wanted of what was made of images.
void insert_sources(DcmDataset& data, const std::vector<volume::DicomImage>& images) {
  for (std::size_t n = 0; n < images.size(); ++n) {
    DcmItem* item = nullptr;
    data.findOrCreateSequenceItem(DCM_SourceInstanceSequence, item, long(n));
    if (!item) throw OutputError("DICOM: a source image cannot be made");
    insert_text(*item, DCM_ReferencedSOPClassUID, images[n].sop_class_uid);
    insert_text(*item, DCM_ReferencedSOPInstanceUID, images[n].sop_instance_uid);
  }
}

std::string bytes_of(const std::string& path, const Triangles& surface,
                     const WriteOptions& options) {
  if (!options.dicom)
    throw InputError(
        fmt::format("{}: a DICOM object belongs to a patient and refers to the images it was made "
                    "of; give the DICOM series, or write another format",
                    path));
  volume::prepare_dcmtk(path);
  const std::string stl = stl_bytes(
      {converted(converted(surface.points, options.space), Space::kLps), surface.elements},
      {Space::kLps});
  const std::string title = volume::long_string(options.name.empty() ? "surface" : options.name);
  ContentHash hash;
  hash.add_bytes(stl);
  hash.add_bytes(title);
  const auto images = instances(*options.dicom);

  DcmDataset data;
  volume::insert_origin(data, *options.dicom, title, path);
  insert_text(data, DCM_SOPClassUID, UID_EncapsulatedSTLStorage);
  volume::insert_series(data, *options.dicom, {"M3D", "surfseg", hash.digits()}, images);
  insert_sources(data, images);
  insert_text(data, DCM_AcquisitionDateTime, "");
  insert_text(data, DCM_BurnedInAnnotation, "NO");
  insert_text(data, DCM_DocumentTitle, title);
  data.insertEmptyElement(DCM_ConceptNameCodeSequence);  // no code says "whatever was clicked"
  volume::insert_code(data, DCM_MeasurementUnitsCodeSequence, "mm", "UCUM", "mm");
  insert_text(data, DCM_MIMETypeOfEncapsulatedDocument, "model/stl");
  // An even number of bytes, as DICOM has it; how many count stands beside.
  std::string padded = stl;
  if (padded.size() % 2 != 0) padded += '\0';
  volume::check_dcmtk(
      data.putAndInsertUint8Array(DCM_EncapsulatedDocument,
                                  reinterpret_cast<const Uint8*>(padded.data()), padded.size()),
      path, "the surface");
  volume::check_dcmtk(data.putAndInsertUint32(DCM_EncapsulatedDocumentLength, Uint32(stl.size())),
                      path, "the surface's size");
  return volume::dicom_bytes(data, path);
}

}  // namespace

extern "C" {
std::string (*const surf_dicom_stl)(const std::string&, const Triangles&,
                                    const WriteOptions&) = bytes_of;
}

}  // namespace surf::io
