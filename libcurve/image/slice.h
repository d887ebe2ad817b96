// Slices of volumes as images.
#pragma once

#include <array>
#include <optional>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surf::curve {

enum class SlicePlane { kAxial, kSagittal, kCoronal };

/// All slices of a volume across the index axis that is nearest to the plane's normal: voxels
/// become pixels without interpolation. Columns and rows are the other two index axes, turned so
/// that one sees what radiologists do: the patient's right on the left and anterior on top in axial
/// slices, right on the left and superior on top in coronal ones, anterior on the left and superior
/// on top in sagittal ones, as nearly as the volume's axes allow.
///
/// The plane's millimetres are the world's: plane_to_ras() of a slice is an isometry. Its thickness
/// is the distance of neighbours.
class VoxelSlices {
 public:
  VoxelSlices(const volume::Volume& volume, SlicePlane plane);

  int n_slices() const { return volume_.size()[axis_[2]]; }
  /// @param k  voxel index along the axis across
  /// @throws InputError  there is no such slice
  Image slice(int k) const;
  /// The voxel of pixel (i, j) of slice k.
  std::array<int, 3> voxel(int i, int j, int k) const;
  const volume::Volume& volume() const { return volume_; }
  /// The voxel index of the slice through or nearest to a point.
  int nearest(const Eigen::Vector3d& point_ras_mm) const;

 private:
  volume::Volume volume_;
  SlicePlane plane_;
  std::array<int, 3> axis_;        // index axis of columns, rows, slices
  std::array<bool, 2> is_turned_;  // columns and rows run against the index
};

/// What a pixel has that lies between voxels. Between labels there is no value.
enum class BetweenVoxels { kLinear, kNearest };

/// The plane through a point across a normal: square pixels of `spacing_mm` (by default the
/// volume's voxel size), as large as the plane's part in the volume. Beyond the volume the values
/// of its border go on. It is as thick as a pixel is wide. Rows run as nearly as can be to the
/// patient's feet, or to the back if the plane is axial.
/// @throws UsageError  a normal of length 0, or the plane misses the volume
Image oblique_slice(const volume::Volume& volume, const Eigen::Vector3d& point_ras_mm,
                    const Eigen::Vector3d& normal, std::optional<double> spacing_mm = {},
                    BetweenVoxels between = BetweenVoxels::kLinear);

/// Curves of one slice in the plane of another one, along that one's normal: each slice counts its
/// millimetres from its own first pixel. Domains stay on the left.
/// @param from, to  plane_to_ras() of the two slices
Segments carried(const Segments& curves, const Eigen::Affine3d& from, const Eigen::Affine3d& to);

/// How another plane lies to curves of a slice.
struct PlaneOffset {
  double most_mm = 0;    ///< greatest distance of a point of the curves
  double angle_deg = 0;  ///< of the normals, whichever way they look: 0 to 90
};
/// @param from, to  as above
PlaneOffset plane_offset(const Segments& curves, const Eigen::Affine3d& from,
                         const Eigen::Affine3d& to);

}  // namespace surf::curve
