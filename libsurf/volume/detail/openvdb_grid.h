// The OpenVDB side of a Volume; included by .cpp files only (its headers are dear).
#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <variant>

#include "libsurf/volume/orientation.h"
#include "libsurf/volume/volume.h"

namespace surf::volume {

template <class T>
using GridOf = openvdb::Grid<typename openvdb::tree::Tree4<T, 5, 4, 3>::Type>;  // FloatGrid's

/// Whole numbers keep 8 or 16 bits if all of a volume fit: what is asked for are floats, which hold
/// them exactly.
using AnyGrid =
    std::variant<GridOf<std::uint8_t>::Ptr, GridOf<std::int16_t>::Ptr, GridOf<float>::Ptr>;

struct Volume::Impl {
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;
  Eigen::Affine3d world_to_index;
  Source source;
  std::shared_ptr<const DicomOrigin> dicom = {};
  std::array<float, 2> range;
  /// The voxels as they were read, at Coord(i, j, k) of the index in that order of the axes.
  AnyGrid grid;
  /// Index axis n runs along axis order.axes[n] of the grid, or against it.
  AxisOrder order = {};
};

/// OpenVDB must be initialised once per process before its registries are used.
void initialize_openvdb();

/// OpenVDB's matrices act on row vectors: the transposes of ours.
openvdb::math::Mat4d to_openvdb(const Eigen::Affine3d& affine);
Eigen::Affine3d from_openvdb(const openvdb::math::Mat4d& matrix);

}  // namespace surf::volume
