// GIFTI 1.0; private to io/*.cpp.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"

namespace surf::io {

/// The bytes of a .surf.gii file: points as float32 and triangles as int32, base64 of zlib's bytes.
/// GIFTI's coordinates are scanner RAS mm (NIFTI_XFORM_SCANNER_ANAT, as the sform of the volumes
/// that are written), whatever options.space is.
/// @param surface  RAS mm
std::string gifti_surface_bytes(const Triangles& surface);

/// The bytes of a .shape.gii file: each array as float32 under its name, in the points' order.
std::string gifti_shape_bytes(const std::vector<PointArray>& arrays);

}  // namespace surf::io
