// Binary glTF 2.0; private to io/*.cpp.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"

namespace surf::io {

/// The bytes of a .glb file: vertices as float32 in the frame and millimetres of the surface, whose
/// node turns them into glTF's metres with the patient upright and looking at the viewer, +X left,
/// +Y superior, +Z anterior (glTF 2.0, 3.4: +Y up, +Z forward). Normals are the mean ones of the
/// areas round a vertex. The arrays are attributes of the application, _DEVIATION_MM and so on.
std::string glb_bytes(const Triangles& surface, const WriteOptions& options);

}  // namespace surf::io
