// Values of a volume between its voxels.
#pragma once

#include "libsurf/volume/volume.h"

namespace surf::volume {

/// Value at a point in voxel indices, linear between voxel centres; NaN outside.
double interpolate(const Volume& volume, const Eigen::Vector3d& index);

}  // namespace surf::volume
