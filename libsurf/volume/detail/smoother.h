// Smoothed intensities of a volume at the nodes of a field's grid.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "libsurf/base/index_box.h"
#include "libsurf/volume/detail/spline.h"
#include "libsurf/volume/detail/tile_store.h"
#include "libsurf/volume/image_fields.h"

namespace surf::volume {

using Index3 = std::array<int, 3>;

/// A box of values, i fastest.
struct ValueBox : IndexBox<3> {
  std::vector<float> values;

  ValueBox(const Index3& low, const Index3& high) : IndexBox<3>(between(low, high)), values(n()) {}
};

inline Index3 widened(Index3 index, const Index3& by, int sign) {
  for (int axis = 0; axis < 3; ++axis) index[axis] += sign * by[axis];
  return index;
}

/// Chunk by chunk, each of them without a branch: 3 times as fast where all are the same.
inline bool is_constant(const ValueBox& box) {
  constexpr std::size_t kChunk = 64;
  const float first = box.values.front();
  for (std::size_t at = 0; at < box.values.size(); at += kChunk) {
    const std::size_t end = std::min(at + kChunk, box.values.size());
    int n_others = 0;
    for (std::size_t n = at; n < end; ++n) n_others += box.values[n] != first;
    if (n_others > 0) return false;
  }
  return true;
}

/// On any box of the grid, which is that of the voxels or, where the Gaussian is wide, one of every
/// factor-th voxel along an axis. There the nodes are kept in tiles of their own, so that boxes
/// which overlap, as splines' tiles do, smooth the voxels between them once. A very wide Gaussian
/// is two, one after the other: of the voxels, and of the nodes of a Smoother with a narrower one.
class Smoother {
 public:
  Smoother(const Volume& volume, const SmoothingOptions& options);
  ~Smoother();

  const Grid& grid() const { return grid_; }
  /// Thread-safe.
  ValueBox box(const Index3& lower, const Index3& upper) const;
  std::size_t memory_bytes() const;

 private:
  /// What a field's grid is for: to be splined, or to be smoothed once more.
  enum class Nodes { kOfASpline, kOfAnotherGaussian };
  Smoother(const Volume& volume, const SmoothingOptions& options, Nodes nodes);

  const float* tile(const Index3& at) const;
  ValueBox smoothed(const Index3& lower, const Index3& upper) const;
  /// What is smoothed. Intensities after the selective Gaussian blur, beyond the volume as at its
  /// nearest voxel; or the nodes of the narrower one.
  ValueBox selected(const Index3& lower, const Index3& upper) const;
  float selective_mean(const ValueBox& raw, int i, int j, int k, const Index3& radius) const;

  Volume volume_;
  std::unique_ptr<const Smoother> narrower_;  // of a very wide Gaussian
  Index3 size_;                               // of what is smoothed: voxels, or its nodes
  float threshold_;
  std::array<double, 3> variance_;            // of the kernel [voxels^2]
  std::array<Kernel, 3> kernel_, selective_;  // [what is smoothed], [voxels]
  Index3 factor_, n_tiles_;
  Grid grid_;
  std::unique_ptr<TileStore> tiles_;  // none where each voxel is a node
};

}  // namespace surf::volume
