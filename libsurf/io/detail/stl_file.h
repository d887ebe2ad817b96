// Binary STL; private to io/*.cpp.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"

namespace surf::io {

/// The bytes of an .stl file, in the frame of the surface, which its header states.
std::string stl_bytes(const Triangles& surface, const WriteOptions& options);

}  // namespace surf::io
