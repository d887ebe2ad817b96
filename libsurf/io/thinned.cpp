#include "libsurf/io/thinned.h"

#include <numeric>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/io/detail/drawing.h"

namespace surf::io {

Thinned thinned(const Triangles& surface, Eigen::Index n_triangles) {
  if (surface.elements.rows() > n_triangles)
    return SURF_LATE(surf_render, surf_decimated)(surface, n_triangles);
  Thinned out{surface, std::vector<int>(std::size_t(surface.points.rows()))};
  std::iota(out.nearest.begin(), out.nearest.end(), 0);
  return out;
}

}  // namespace surf::io
