// The piecewise smooth approximation of a volume that belongs to a surface.
#pragma once

#include <string>

#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

struct DenoisedOptions {
  double tolerance = 1e-5;  ///< of the solver
  /// Voxels are solved for in blocks of this many along each axis, and as many more on each side as
  /// make up `margin` times sqrt(mu): memory does not grow with the volume.
  int block = 192;
  double margin = 8;

  std::string error() const;  ///< empty if valid
};

/// u = u_1 chi_1 + u_2 chi_2 (5.4) at the voxels, in the volume's unit: -mu Lap u_i + u_i = I
/// inside and outside the surface with d_nu u_i = 0 on it and I the voxels' own values, so that u
/// jumps across the surface. A voxel is inside if its centre is.
/// @param mu  [mm^2], > 0
/// @throws UsageError  mu or the options are not valid
volume::Volume denoised(const volume::Volume& volume, const Triangles& surface, double mu,
                        const DenoisedOptions& options = {});

}  // namespace surf::segment
