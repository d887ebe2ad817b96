// Values of a volume between its voxels.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "libsurf/volume/volume.h"

namespace surf::volume {

/// Values at points in voxel indices, linear between voxel centres; NaN outside. Fastest where
/// points that follow one another lie near each other, as the pixels of a slice do.
std::vector<double> interpolate(const Volume& volume, std::span<const Eigen::Vector3d> indices);

}  // namespace surf::volume
