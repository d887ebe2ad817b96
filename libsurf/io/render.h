// A surface in three dimensions, drawn by VTK off screen.
#pragma once

#include <array>
#include <optional>

#include "libsurf/base/types.h"
#include "libsurf/io/picture.h"
#include "libsurf/io/write_surface.h"

namespace surf::io {

struct RenderOptions {
  /// Size of the picture in pixels; two views share its width.
  int width = 1500, height = 750;
  bool has_edges = false;  ///< draw the edges of the triangles
  /// A number of each point, shown by colours: dark blue, green, yellow (viridis) from the least to
  /// the largest that the bar at the foot states; beyond as at its ends. None = all one colour.
  std::optional<PointArray> colors = {};
  /// Ends of the bar; none = 0, or the least number if it is below, and the 98th percentile.
  std::optional<std::array<double, 2>> range = {};
};

/// The surface with smooth shading from two sides: from the front, its right and above, and
/// from the patient's left. Drawing needs an X display with GLX, although no window shows;
/// a machine without one runs the program under xvfb-run.
/// @throws OutputError  no display, or one that cannot draw
/// @throws UsageError   a width or height outside 100 to 10000
/// @throws InvalidMesh  no triangles, or another number of colours than points
Picture render_surface(const Triangles& surface, const RenderOptions& options = {});

}  // namespace surf::io
