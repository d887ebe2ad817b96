// What of a closed surface lies in a volume.
#pragma once

#include "libsurf/base/image_box.h"
#include "libsurf/base/types.h"

namespace surf::mesh {

/// The boundary of what a closed surface encloses within a box; the surface itself if it lies in
/// the box (ImageBox::is_beyond()). Vertices on the box's faces lie on them to rounding; those up
/// to 0.001 cells beside a face are put on it, up to 0.016 where the surface would touch itself
/// there otherwise. Where it does however far they are taken, what the first cut has left.
/// @param surface  free of self-intersections
/// @throws InvalidMesh  nothing of it lies in the box, or it cannot be clipped
Triangles clipped(const Triangles& surface, const ImageBox<3>& box);

}  // namespace surf::mesh
