// The voxels of a Volume in leaves and tiles of OpenVDB; in the library surf_vdb, for OpenVDB's
// start costs more than the rest of a program's (docs/performance.md).
#pragma once

#include <array>
#include <memory>
#include <span>

namespace surf::volume {

/// One value for each index (i, j, k), 0 <= index < size; zero where none was stored. Voxels that
/// are equal over a cube of 8^3 take no room of their own. Reading is thread-safe.
class VoxelGrid {
 public:
  static constexpr int kSlab = 8;  ///< slices that are stored at once

  virtual ~VoxelGrid() = default;

  /// 1 for whole numbers in 0..255 (at first), 2 in -32768..32767, 4 for floats.
  virtual int bytes_per_voxel() const = 0;
  /// The same values in this many bytes a voxel; the old and the new ones are in memory together.
  virtual void widen(int bytes_per_voxel) = 0;

  /// Slices first, first + 1, ..., at most kSlab of them, i fastest; first is a multiple of kSlab,
  /// and bytes_per_voxel() hold the values.
  virtual void store_slab(std::span<const float> slab, int first) = 0;

  virtual float value(const std::array<int, 3>& index) const = 0;
  /// Voxels lower <= (i, j, k) < upper, i fastest; all of them are there.
  virtual void copy_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                        float* out) const = 0;
};

extern "C" {
extern std::unique_ptr<VoxelGrid> (*const surf_make_voxel_grid)(const std::array<int, 3>& size);
}

}  // namespace surf::volume
