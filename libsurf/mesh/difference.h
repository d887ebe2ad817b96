// One solid without another: surfaces of neighbours that share a wall.
#pragma once

#include "libsurf/base/types.h"
#include "libsurf/mesh/parted.h"

namespace surf::mesh {

/// Every vertex moved by `distance_mm` along the mean of its triangles' normals, weighted by their
/// angles there; outwards if it is positive. May intersect itself where it is large.
Triangles moved_along_normals(const Triangles& surface, double distance_mm);

/// The boundary of what lies in the first solid and not in the second: triangles of the first
/// outside the second, and those of the second inside the first, flipped; those that are cut are
/// cut exactly, and the new vertices rounded to doubles. Vertices of either surface stay as they
/// are, bit for bit. O(n log n).
///
/// @param surface, other  closed, manifold, outward and without self-intersections
/// @throws InvalidMesh  the difference is not a manifold: the surfaces touch in a vertex or edge
Triangles difference(const Triangles& surface, const Triangles& other);

/// Whether two solids have an inner point in common, or their surfaces touch; exact.
/// @param first, second  as those of difference()
bool do_overlap(const Triangles& first, const Triangles& second);

/// Takes from a solid what lies in another one, or nearer to it than the gap: there its wall is
/// that of the other one, at that distance. Elsewhere it stays, bit for bit; gaps wider than that
/// are not touched.
///
/// The difference with the other one enlarged by the gap, and the triangles along the cut mended
/// within half of it (improve.h). What comes out is rounded and verified (verify.h, do_overlap());
/// where it fails, it is tried without mending and with other gaps.
///
/// @param surface, other  as those of difference(), as the files hold them
/// @throws UsageError   options.error() is not empty
/// @throws InvalidMesh  no try passes
Parted<3> parted(const Triangles& surface, const Triangles& other, const PartOptions<3>& options);

}  // namespace surf::mesh
