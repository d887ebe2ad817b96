#include "libsurf/io/render.h"

#include <fmt/format.h>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/io/detail/drawing.h"

namespace surf::io {
namespace {

void check(const Triangles& surface, const RenderOptions& options) {
  for (const int size : {options.width, options.height})
    if (size < 100 || size > 10000)
      throw UsageError(fmt::format("size of the picture: expected 100 to 10000 pixels; got {} x {}",
                                   options.width, options.height));
  if (surface.elements.rows() == 0) throw InvalidMesh("the surface to draw has no triangles");
  if (options.colors && options.colors->values.size() != surface.points.rows())
    throw InvalidMesh(fmt::format("the surface to draw has {} points, but there are {} values",
                                  surface.points.rows(), options.colors->values.size()));
}

}  // namespace

Picture render_surface(const Triangles& surface, const RenderOptions& options) {
  check(surface, options);
  return SURF_LATE(surf_render, surf_drawn)(surface, options);
}

}  // namespace surf::io
