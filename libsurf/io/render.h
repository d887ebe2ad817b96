// A surface in three dimensions, drawn by VTK off screen.
#pragma once

#include "libsurf/base/types.h"
#include "libsurf/io/picture.h"

namespace surf::io {

struct RenderOptions {
  /// Size of the picture in pixels; two views share its width.
  int width = 1500, height = 750;
  bool has_edges = false;  ///< draw the edges of the triangles
};

/// The surface with smooth shading from two sides: from the front, its right and above, and
/// from the patient's left. Drawing needs an X display with GLX, although no window shows;
/// a machine without one runs the program under xvfb-run.
/// @throws OutputError  no display, or one that cannot draw
/// @throws UsageError   a width or height outside 100 to 10000
/// @throws InvalidMesh  no triangles
Picture render_surface(const Triangles& surface, const RenderOptions& options = {});

}  // namespace surf::io
