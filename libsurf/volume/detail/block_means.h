// Means over blocks of voxels, taken while a volume is built.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "libsurf/volume/volume.h"

namespace surf::volume {

/// How many voxels make a block along each index axis: blocks are about cubes in mm, as many as
/// Volume::coarser() says.
/// @return  nothing where blocks would be of fewer than 16 voxels
std::optional<std::array<int, 3>> block_size(const std::array<int, 3>& size,
                                             const Eigen::Affine3d& index_to_world);

/// Blocks begin where the volume begins in RAS order, whatever the order of its axes, so that the
/// last one along an axis may be of fewer voxels; its mean stands where a whole one's would.
class BlockMeans {
 public:
  /// @param block   block_size() of the volume
  /// @param source  of the volume, for messages
  BlockMeans(const std::array<int, 3>& size, const Eigen::Affine3d& index_to_world,
             const std::array<int, 3>& block, const Source& source);

  /// Slices k = first, first + 1, ...; the next slab follows them. Means are those of exact sums as
  /// long as doubles hold these: blocks of one value have it to the bit.
  void add(std::span<const float> slab, int first);
  /// @pre  all slices were added
  Volume finish() { return builder_.finish(); }

 private:
  /// Voxels begin <= index < end along an axis.
  struct Range {
    int begin, end;
  };
  Range block_range(int axis, int at) const;

  std::array<int, 3> size_, block_, n_blocks_;
  std::array<int, 3> missing_;  ///< voxels of the first block along each axis
  std::vector<double> rows_;    ///< of each row of blocks its rows' sum in the blocks not yet whole
  Volume::Builder builder_;
};

}  // namespace surf::volume
