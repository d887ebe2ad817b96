// What a surgery did to the shells of a surface. Private to surgery.
#pragma once

#include <vector>

#include "libsurf/mesh/detail/surgery_cluster.h"
#include "libsurf/mesh/surgery.h"

namespace surf::mesh {

/// One for each cluster; whether whole components had to be rebuilt is left open.
std::vector<RebuiltRegion> rebuilt_regions(const ConnectedSurface& surface,
                                           const std::vector<Cluster>& clusters);

}  // namespace surf::mesh
