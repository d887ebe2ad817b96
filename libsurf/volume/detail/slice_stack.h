// Slices of a DICOM series put in order and checked: a volume, or the reason why it is none.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace surf::volume {

/// One slice as its header places it; LPS mm, as DICOM has it.
struct DicomSlice {
  std::string file;
  int frame = 0;  ///< in the file
  int rows = 0, columns = 0;
  Eigen::Vector3d position_lps_mm;  ///< centre of the first pixel (ImagePositionPatient)
  Eigen::Vector3d along_row_lps, along_column_lps;  ///< unit vectors (ImageOrientationPatient)
  double pixel_width_mm = 0, pixel_height_mm = 0;   ///< PixelSpacing[1] and [0]
  double slope = 1, intercept = 0;                  ///< of this slice
  std::string sop_class_uid, sop_instance_uid;      ///< of its file
  int n_frames = 1;                                 ///< in the file
};

struct SliceStack {
  std::vector<DicomSlice> slices;  ///< in the order of k
  std::array<int, 3> size;
  Eigen::Matrix4d index_to_world;  ///< RAS mm
  double tilt_deg = 0;             ///< between the stack's axis and the slices' normal: gantry tilt
};

/// Sorts slices by position along their common normal. The step of k is the mean step between
/// first pixels, so that a gantry tilt becomes the affine's shear.
/// @throws InputError  one slice only; sizes, orientations or pixel spacings that differ; two
///                     slices at one place; a gap (with its place, size and how many slices are
///                     missing) or positions that are off one line by more than rounding
SliceStack stack_slices(std::vector<DicomSlice> slices, const std::string& path);

}  // namespace surf::volume
