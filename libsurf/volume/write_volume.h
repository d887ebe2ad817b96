// Volumes and label maps as files other programs read.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "libsurf/volume/volume.h"

namespace surf::volume {

/// True if `path` ends like a volume that can be written: .nii, .nii.gz, .mha, .nrrd.
bool is_writable_volume(const std::string& path);

/// The endings of the files that hold label maps, the most usual first: those of volumes, .seg.nrrd
/// and .seg.dcm.
std::vector<std::string> label_map_endings();

/// True if `path` ends like a label map that can be written: as a volume, or .dcm.
bool is_writable_label_map(const std::string& path);

/// The endings for messages: ".nii.gz, .seg.nrrd, ... or .seg.dcm".
std::string writable_label_maps();

/// Writes a volume as 32-bit floats, in the format of the name's ending: NIfTI-1 (.nii, .nii.gz),
/// MetaImage (.mha) or NRRD (.nrrd). The file is written whole or not at all.
/// @throws UsageError   another ending
/// @throws OutputError  the file cannot be written; more than 32767 voxels along an axis (NIfTI)
void write_volume(const std::string& path, const Volume& volume);

/// The same, as NIfTI-1 whatever the ending; compressed if it is .nii.gz. The affine is in the
/// sform (code 1); in the qform too when it is a rotation, perhaps mirrored, times the spacing.
void write_nifti(const std::string& path, const Volume& volume);

/// What a label stands for.
struct LabelName {
  std::uint8_t label = 1;
  std::string name;
  std::array<std::uint8_t, 3> colour = {227, 218, 201};  ///< sRGB; of bone
};

/// Writes labels (size[0] * size[1] * size[2] values, i fastest) as unsigned bytes, in the
/// format of the name's ending as above. A name that ends in .seg.nrrd makes it a segmentation of
/// 3D Slicer, with the names, colours and extents of its segments; the other formats have no place
/// for names.
/// @param names  of the labels that are segments, in their order
/// @throws UsageError, OutputError  as above; labels.size() is not the product of the sizes
/// @throws InputError               .dcm, of which only the form below knows enough
void write_label_map(const std::string& path, const std::array<int, 3>& size,
                     const Eigen::Affine3d& index_to_world, std::span<const std::uint8_t> labels,
                     std::span<const LabelName> names = {});

/// The same on the grid of a volume. If this came from DICOM the name may also end in .dcm: a DICOM
/// Segmentation (binary) in the frame of reference of the series, with the names and colours of its
/// segments, each frame with the image that it was made of. The content's date is that of now, or
/// of SOURCE_DATE_EPOCH; everything else follows from what is given, UIDs too.
/// @throws InputError   .dcm: as check_dicom_output
/// @throws OutputError  .dcm: no voxel has a label
void write_label_map(const std::string& path, const Volume& grid,
                     std::span<const std::uint8_t> labels, std::span<const LabelName> names = {});

}  // namespace surf::volume
