// The volume's values inside a surface and in a shell round it.
#pragma once

#include <cstddef>

#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surf::mesh {

/// Of the values of some voxels; all 0 without any.
struct IntensityStatistics {
  std::size_t n_voxels = 0;
  double mean = 0, standard_deviation = 0;  ///< the latter with n - 1
  double median = 0, percentile_5 = 0,
         percentile_95 = 0;  ///< values of voxels: order floor(q (n - 1))
};

struct RegionIntensities {
  IntensityStatistics inside, shell;
  double shell_mm = 0;  ///< thickness
};

/// Of the voxels whose centres lie inside (rasterize.h says which), and of those outside whose
/// centres are no further than shell_mm from the surface.
/// @throws InvalidMesh  no triangle with an area
RegionIntensities region_intensities(const Triangles& surface, const volume::Volume& volume,
                                     double shell_mm = 5);

}  // namespace surf::mesh
