// A scalar volume in the world frame.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libsurf/volume/dicom_origin.h"

namespace surf::volume {

/// Where a volume came from; for `surfseg info` and reports. Nothing computes with it.
struct Source {
  std::string path;
  std::string format;       ///< "NIfTI-1", "DICOM series", ...
  std::string scalar_type;  ///< type in the file: "int16", "float32", ...
  std::string
      orientation_source;  ///< which field gave the affine: "sform", "ImagePositionPatient", ...
  int n_frames = 1;        ///< frames in the file (4-D)
  int frame = 0;           ///< the one that was read
  std::vector<std::string> notes;  ///< what a user should know: gantry tilt, dropped slices, ...
};

/// Scalar values at voxel centres, index (i, j, k) with i fastest, and the affine map
/// from voxel centre to world: right-handed RAS+ millimetres. Any invertible
/// affine is legal: oblique, mirrored, sheared, anisotropic.
///
/// Immutable and cheap to copy (the grid is shared); reading is thread-safe. Voxels take 1 or 2
/// bytes where all are whole numbers in 0..255 or -32768..32767, else 4.
class Volume {
 public:
  class Builder;

  /// From dense values, i fastest.
  /// @throws InputError  see Builder
  Volume(const std::array<int, 3>& size, const Eigen::Affine3d& index_to_world,
         std::span<const float> values);

  const std::array<int, 3>& size() const;
  std::size_t n_voxels() const;
  const Eigen::Affine3d& index_to_world() const;
  const Eigen::Affine3d& world_to_index() const;
  /// Lengths of the affine's columns [mm].
  Eigen::Vector3d spacing() const;
  /// Cube root of the voxel's volume [mm]: the "vox" of lengths.
  double voxel_size() const;
  const Source& source() const;
  /// What DICOM objects that refer to this volume have to know; null if it did not come from DICOM,
  /// or its axes are not in the order of the slices.
  const std::shared_ptr<const DicomOrigin>& dicom() const;
  /// Smallest and largest value.
  std::array<float, 2> range() const;
  /// Of a voxel as it is held: 1, 2 or 4.
  int bytes_per_voxel() const;

  /// Means over blocks of voxels, taken while it was built, about 2^22 cubes or a few times as
  /// many: for what looks at all of a large volume, but not closely. Nothing where blocks would be
  /// of fewer than 16 voxels. Floats.
  std::optional<Volume> coarser() const;

  float value(int i, int j, int k) const;
  /// Copies the voxels lower <= (i, j, k) < upper, i fastest, into out; indices outside
  /// the volume take the value of the nearest voxel inside.
  void copy_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper, float* out) const;

  /// The same voxels with the index axes in the order and direction in which they run most nearly
  /// to R, A and S (ras_order()), and the place of the first one rounded to 2^-10 of a voxel's
  /// size: files that hold one scan with its axes in another order, their affines rounded to
  /// floats, give the same volume, to the bit. Shares the voxels with this one.
  Volume in_ras_order() const;

 private:
  struct Impl;
  explicit Volume(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;
};

/// Builds a volume slice by slice, so that a reader never holds a second dense copy.
class Volume::Builder {
 public:
  /// @throws InputError  a size < 2 (2-D or empty), a singular, non-finite or non-affine
  ///                     matrix, zero spacing, or more voxels than memory can hold
  Builder(const std::array<int, 3>& size, const Eigen::Matrix4d& index_to_world, Source source);
  ~Builder();
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  /// Appends slice k = 0, 1, ...: size[0] * size[1] values, i fastest.
  /// @throws InputError  NaN or Inf, with the place, in this one or one before; more than memory
  ///                     can hold
  void append_slice(std::span<const float> values);

  void set_dicom(DicomOrigin origin);

  /// @throws InputError  as append_slice(); fewer slices came than size[2]
  Volume finish();

 private:
  struct Storing;

  std::shared_ptr<Impl> impl_;
  std::vector<float> slab_;  // slices not yet handed over
  int n_slices_ = 0;
  std::unique_ptr<Storing> storing_;  // one slab, while the reader fetches the next
};

}  // namespace surf::volume
