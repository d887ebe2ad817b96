#include "libsurf/volume/interpolate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace surf::volume {
namespace {

using Index3 = std::array<int, 3>;

/// The voxel below a point along each axis that has one above it.
Index3 voxel_below(const Index3& size, const Eigen::Vector3d& index) {
  Index3 below;
  for (int axis = 0; axis < 3; ++axis)
    below[axis] = std::clamp(static_cast<int>(std::floor(index[axis])), 0, size[axis] - 2);
  return below;
}

bool is_inside(const Index3& size, const Eigen::Vector3d& index) {
  constexpr double kRounding = 1e-9;  // of an index, at the border
  for (int axis = 0; axis < 3; ++axis)
    if (!(index[axis] >= -kRounding && index[axis] <= size[axis] - 1 + kRounding)) return false;
  return true;
}

/// The voxels lower <= index <= upper, in one array.
struct VoxelBox {
  Index3 lower, upper;

  std::size_t n_voxels() const {
    std::size_t n = 1;
    for (int axis = 0; axis < 3; ++axis) n *= std::size_t(upper[axis] + 1 - lower[axis]);
    return n;
  }
};

double interpolated(const VoxelBox& box, const std::vector<float>& values, const Index3& below,
                    const Eigen::Vector3d& index) {
  const std::size_t row = box.upper[0] + 1 - box.lower[0];
  const std::size_t slice = row * (box.upper[1] + 1 - box.lower[1]);
  const std::size_t at = (below[0] - box.lower[0]) + (below[1] - box.lower[1]) * row +
                         (below[2] - box.lower[2]) * slice;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<bool, 3> is_upper = {(corner & 1) != 0, (corner & 2) != 0, (corner & 4) != 0};
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = index[axis] - below[axis];
      weight *= is_upper[axis] ? share : 1 - share;
    }
    sum += weight * values[at + is_upper[0] + is_upper[1] * row + is_upper[2] * slice];
  }
  return sum;
}

/// Copies the voxels round all of the points at once if those are not many more than the points,
/// and otherwise halves the points.
void interpolate(const Volume& volume, std::span<const Eigen::Vector3d> indices,
                 std::span<double> out) {
  constexpr std::size_t kMostVoxels = 1 << 22, kMostPerPoint = 64;
  constexpr int kNone = std::numeric_limits<int>::max();
  VoxelBox box = {{kNone, kNone, kNone}, {0, 0, 0}};
  for (const Eigen::Vector3d& index : indices) {
    if (!is_inside(volume.size(), index)) continue;
    const Index3 below = voxel_below(volume.size(), index);
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = std::min(box.lower[axis], below[axis]);
      box.upper[axis] = std::max(box.upper[axis], below[axis] + 1);
    }
  }
  if (box.lower[0] == kNone) return;
  if (box.n_voxels() > std::min(kMostVoxels, kMostPerPoint * indices.size())) {
    const std::size_t half = indices.size() / 2;
    interpolate(volume, indices.first(half), out.first(half));
    interpolate(volume, indices.subspan(half), out.subspan(half));
    return;
  }
  std::vector<float> values(box.n_voxels());
  volume.copy_box(box.lower, {box.upper[0] + 1, box.upper[1] + 1, box.upper[2] + 1}, values.data());
  for (std::size_t n = 0; n < indices.size(); ++n)
    if (is_inside(volume.size(), indices[n]))
      out[n] = interpolated(box, values, voxel_below(volume.size(), indices[n]), indices[n]);
}

}  // namespace

std::vector<double> interpolate(const Volume& volume, std::span<const Eigen::Vector3d> indices) {
  std::vector<double> out(indices.size(), std::numeric_limits<double>::quiet_NaN());
  interpolate(volume, indices, out);
  return out;
}

}  // namespace surf::volume
