// 3MF, core specification 1.2; private to io/*.cpp.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"

namespace surf::io {

/// The bytes of a .3mf file: in millimetres, each solid (a shell with its cavities) an object of
/// its own that has the name (with a number if there are several) and the colour of the options.
/// Coordinates have all digits of a float.
///
/// Debian's lib3mf 1.8 is not asked: it writes six decimals, so that the surface in the file would
/// not be the one that was verified, and random UUIDs, so that no two files were the same.
std::string threemf_bytes(const Triangles& surface, const WriteOptions& options);

}  // namespace surf::io
