// A surface with fewer triangles, to look at.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::io {

struct Thinned {
  Triangles surface;
  std::vector<int> nearest;  ///< of each point: the nearest one of the surface it comes from
};

/// The surface with about so many triangles, by VTK's quadric decimation; as it is if it has no
/// more. For pictures alone: nothing is guaranteed of it.
Thinned thinned(const Triangles& surface, Eigen::Index n_triangles);

}  // namespace surf::io
