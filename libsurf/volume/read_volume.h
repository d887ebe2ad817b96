// Volumes from files: NIfTI, MetaImage, NRRD, DICOM, VTK image data, OpenVDB.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/volume/volume.h"

namespace surf::volume {

/// A file that no reader takes for one of its own.
class NotAVolume : public InputError {
 public:
  using InputError::InputError;
};

struct ReadOptions {
  /// Frame of a 4-D file, from 0.
  int frame_index = 0;
  /// Which series of a DICOM folder, by its SeriesInstanceUID; needed if it holds several. Other
  /// formats have none: a UsageError.
  std::optional<std::string> series_uid;
};

/// Reads a volume; the format is recognised by the file's content. `path` is a file or a folder
/// of DICOM files; of a pair of files (.hdr/.img, .mhd/.raw, .nhdr/.raw) give the header, or of a
/// DICOM series any one file.
///
/// Every reader maps its format's world into RAS mm:
///  - NIfTI-1/2: the sform if sform_code > 0, else the qform if qform_code > 0, else the spacing
///    alone with a note; xyzt_units applied; value = scl_slope * stored + scl_inter.
///  - MetaImage and DICOM: LPS. NRRD: its `space`; LPS with a note if it has none.
///  - VTI and OpenVDB have no anatomical convention: their coordinates are taken as RAS mm.
///
/// Values are read slice by slice: the peak of memory is the volume's 4 bytes per voxel and a
/// few slices; for OpenVDB, DICOM of several frames, and NRRD as text or in several files also the
/// values as stored in the file.
/// @throws InputError  "path: what; what to do": missing, empty, truncated or damaged, not a
///                     volume, of an unsupported kind, without a usable affine, NaN or Inf,
///                     beyond memory, no such frame, several DICOM series, uneven slices
/// @throws NotAVolume
Volume read_volume(const std::string& path, const ReadOptions& options = {});

/// All files that read_volume() may read: of a pair both, the header first; of a header those that
/// it names for its voxels, of a pattern of names all in its folder that fit it; of a folder, or of
/// one DICOM file, all in the folder, sorted. Only headers are read.
/// @throws InputError  as read_volume: missing, not a volume, a broken header, a data file that it
///                     names and that is missing
/// @throws NotAVolume
std::vector<std::string> volume_files(const std::string& path);

/// Whether a DICOM file is part of a series of images: reports and segmentations lie beside them.
/// @throws InputError  as read_volume: missing, damaged
bool is_dicom_image(const std::string& path);

/// One of the series in a folder of DICOM files.
struct DicomSeries {
  std::string uid;  ///< for ReadOptions::series_uid
  std::string modality, description;
  std::size_t n_files = 0;
};

/// The series in a folder of DICOM files, in the order of their UIDs; only headers are read.
/// @throws InputError  as read_volume: no DICOM image in it, a damaged file
std::vector<DicomSeries> dicom_series(const std::string& folder);

}  // namespace surf::volume
