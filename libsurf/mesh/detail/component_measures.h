// Measures of the components of a surface, shared between sources of this library.
#pragma once

#include <vector>

#include "libsurf/mesh/detail/edge_uses.h"
#include "libsurf/mesh/measure.h"

namespace surf::mesh {

/// measure_components() where the edges and components are known.
std::vector<ComponentMeasures> measure_components(const Triangles& surface,
                                                  const std::vector<EdgeUse>& uses,
                                                  const Components& parts);

}  // namespace surf::mesh
