// Whether a file is DICOM through and through, before GDCM may see it.
#pragma once

#include <cstdint>
#include <string>

namespace surf::volume {

enum class DicomStructure {
  kNone,   ///< not DICOM, or DICOM without pixels
  kCut,    ///< DICOM that is cut or damaged: an element does not fit, or is none
  kImage,  ///< every element is whole, to the end of the file
};

struct DicomFile {
  DicomStructure structure = DicomStructure::kNone;
  std::uint64_t n_pixel_bytes = 0;  ///< as they are stored, without what lies between fragments
  bool is_compressed = false;       ///< the pixels are fragments
};

/// Walks over the elements of a file without looking at their values. Debian's GDCM is built
/// with its assertions on: it aborts the process on files that end at certain places, where
/// this says kCut.
/// @throws InputError  the file cannot be read
DicomFile dicom_structure(const std::string& path);

}  // namespace surf::volume
