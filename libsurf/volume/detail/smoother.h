// Smoothed intensities of a volume at the nodes of a field's grid.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "libsurf/base/index_box.h"
#include "libsurf/volume/detail/spline.h"
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

inline bool is_constant(const ValueBox& box) {
  return std::all_of(box.values.begin(), box.values.end(),
                     [&](float value) { return value == box.values.front(); });
}

class NodeMeans;

/// On any box of the grid, which is that of the voxels or, where the Gaussian is wide, one of every
/// factor-th voxel along an axis. There the voxels round each node are averaged first, by a
/// triangle, and what the Gaussian has left to do is done on the nodes: the variances of the
/// triangle, of it and of the wider spline add up to those of the Gaussian and of the voxels'
/// spline.
class Smoother {
 public:
  Smoother(const Volume& volume, const SmoothingOptions& options);
  ~Smoother();

  const Grid& grid() const { return grid_; }
  /// Thread-safe.
  ValueBox box(const Index3& lower, const Index3& upper) const;

 private:
  Grid grid_;
  std::array<Kernel, 3> kernel_;  // [nodes]
  std::unique_ptr<NodeMeans> means_;
};

}  // namespace surf::volume
