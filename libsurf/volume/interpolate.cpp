#include "libsurf/volume/interpolate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surf::volume {

double interpolate(const Volume& volume, const Eigen::Vector3d& index) {
  constexpr double kRounding = 1e-9;  // of an index, at the border
  std::array<int, 3> first;
  Eigen::Vector3d share;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.size()[axis] - 1;
    if (!(index[axis] >= -kRounding && index[axis] <= last + kRounding))
      return std::numeric_limits<double>::quiet_NaN();
    first[axis] = std::clamp(static_cast<int>(std::floor(index[axis])), 0, last - 1);
    share[axis] = index[axis] - first[axis];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::array<int, 3> voxel = first;
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_upper = (corner >> axis & 1) != 0;
      weight *= is_upper ? share[axis] : 1 - share[axis];
      voxel[axis] += is_upper ? 1 : 0;
    }
    sum += weight * volume.value(voxel[0], voxel[1], voxel[2]);
  }
  return sum;
}

}  // namespace surf::volume
