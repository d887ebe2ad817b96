// What of a closed surface lies in a volume.
#pragma once

#include "libsurf/base/image_box.h"
#include "libsurf/base/types.h"

namespace surf::mesh {

/// The boundary of what a closed surface encloses within a box; the surface itself if it lies in
/// the box. Vertices on the box's faces lie on them to rounding.
/// @param surface  free of self-intersections
/// @throws InvalidMesh  nothing of it lies in the box, or it cannot be clipped
Triangles clipped(const Triangles& surface, const ImageBox<3>& box);

}  // namespace surf::mesh
