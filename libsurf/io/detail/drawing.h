// What VTK draws and thins; in the library surf_render.
#pragma once

#include "libsurf/io/render.h"
#include "libsurf/io/thinned.h"

namespace surf::io {

extern "C" {
/// See render_surface; what is given has been checked.
/// @throws OutputError
extern Picture (*const surf_drawn)(const Triangles& surface, const RenderOptions& options);
/// See thinned; there are more triangles.
extern Thinned (*const surf_decimated)(const Triangles& surface, Eigen::Index n_triangles);
}

}  // namespace surf::io
