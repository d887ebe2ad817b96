// What a volume keeps of the DICOM series that it came from, for objects that refer to it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace surf::volume {

class Volume;

/// An attribute as it stands in the file, in the series' character set.
struct DicomAttribute {
  std::uint16_t group = 0, element = 0;
  std::string value;
};

/// The image of one slice.
struct DicomImage {
  std::string sop_class_uid, sop_instance_uid;
  int frame = 0;                                              ///< from 1; 0 = an image of one frame
  Eigen::Vector3d position_lps_mm = Eigen::Vector3d::Zero();  ///< centre of the first pixel
};

struct DicomOrigin {
  /// Patient, study and frame of reference, and their character set; ascending.
  std::vector<DicomAttribute> attributes;
  std::string series_uid;
  int series_number = 0;
  Eigen::Vector3d along_row_lps, along_column_lps;  ///< unit vectors (ImageOrientationPatient)
  double pixel_width_mm = 0, pixel_height_mm = 0;
  std::vector<DicomImage> images;  ///< of slice k = 0, 1, ...

  /// "" if there is none.
  std::string value(std::uint16_t group, std::uint16_t element) const;
};

/// Whether a DICOM object can be made of what is found in this volume; other endings than .dcm are
/// not looked at.
/// @throws InputError   the volume is none of DICOM, or its series lacks a UID
/// @throws OutputError  this library was built without DCMTK
void check_dicom_output(const std::string& path, const Volume& volume);

}  // namespace surf::volume
