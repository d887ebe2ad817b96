#include "libsurf/volume/interpolate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "libsurf/base/index_box.h"

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

double interpolated(const IndexBox<3>& box, const std::vector<float>& values, const Index3& below,
                    const Eigen::Vector3d& index) {
  const std::size_t at = box.at(below), row = box.stride(1), slice = box.stride(2);
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
  Index3 lower = {kNone, kNone, kNone}, upper = {0, 0, 0};
  for (const Eigen::Vector3d& index : indices) {
    if (!is_inside(volume.size(), index)) continue;
    const Index3 below = voxel_below(volume.size(), index);
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], below[axis]);
      upper[axis] = std::max(upper[axis], below[axis] + 2);
    }
  }
  if (lower[0] == kNone) return;
  const auto box = IndexBox<3>::between(lower, upper);
  if (box.n() > std::min(kMostVoxels, kMostPerPoint * indices.size())) {
    const std::size_t half = indices.size() / 2;
    interpolate(volume, indices.first(half), out.first(half));
    interpolate(volume, indices.subspan(half), out.subspan(half));
    return;
  }
  std::vector<float> values(box.n());
  volume.copy_box(lower, upper, values.data());
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
