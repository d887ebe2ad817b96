// Triangle surfaces from STL, OBJ, PLY, VTP and legacy VTK files.
#pragma once

#include <string>

#include "libsurf/base/types.h"

namespace surf::io {

/// Reads the surface of a file, by the ending of `path`, into RAS mm: .stl (binary, ASCII), .obj,
/// .ply (ASCII, binary of both endians), .vtp, .vtk (legacy polygon data).
///
/// A statement SPACE=RAS or SPACE=LPS in the header is honoured (space.h); a file without
/// one is LPS, as for Slicer. Polygons with more than three vertices, taken for convex,
/// become a fan of triangles round their first vertex. The facets of STL become a surface
/// by welding vertices with equal coordinates; the other formats keep their points as they
/// are, unused ones too. Normals, colours and other data are dropped. The surface may be
/// open, non-manifold or intersecting: mesh/verify.h tells.
///
/// @throws InputError  missing, empty or truncated; not of its format; a number that is not
///                     one, or not finite; a face with fewer than three vertices or one
///                     that names a missing vertex; no faces; triangle strips. The
///                     message names the file and, for text, the line.
Triangles read_surface(const std::string& path);

/// True if `path` ends like a surface file that can be read.
bool is_readable_surface(const std::string& path);

}  // namespace surf::io
