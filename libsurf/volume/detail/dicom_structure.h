// Whether a file is DICOM through and through, before GDCM may see it.
#pragma once

#include <string>

namespace surf::volume {

enum class DicomStructure {
  kNone,   ///< not DICOM, or DICOM without pixels
  kCut,    ///< DICOM that is cut or damaged: an element does not fit, or is none
  kImage,  ///< every element up to and with the pixel data is whole
};

/// Walks over the elements of a file without looking at their values. Debian's GDCM is built
/// with its assertions on: it aborts the process on files that end at certain places, where
/// this says kCut.
/// @throws InputError  the file cannot be read
DicomStructure dicom_structure(const std::string& path);

}  // namespace surf::volume
