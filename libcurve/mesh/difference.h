// One region without another: curves of neighbours that share a wall.
#pragma once

#include "libsurf/base/types.h"
#include "libsurf/mesh/parted.h"

namespace surf::curve {

/// Every node moved by `distance_mm` along the bisector of its elements' normals; outwards if it is
/// positive. May intersect itself where it is large.
Segments moved_along_normals(const Segments& curves, double distance_mm);

/// Whether two regions have an inner point in common, or their curves touch; exact.
/// @param first, second  closed, simple and alternating
bool do_overlap(const Segments& first, const Segments& second);

/// Takes from a region what lies in another one, or nearer to it than the gap: mesh::parted() in
/// the plane. Where the winding number of the curves less that of the other ones, enlarged by the
/// gap, is at least one (surgery.h); checked by verify() and do_overlap(), and tried with other
/// gaps where it fails.
///
/// @param curves, other  closed, simple and alternating
/// @throws UsageError   options.error() is not empty
/// @throws InvalidMesh  no try passes
mesh::Parted<2> parted(const Segments& curves, const Segments& other,
                       const mesh::PartOptions<2>& options);

}  // namespace surf::curve
