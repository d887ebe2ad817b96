// Volume-preserving mesh smoothing, thesis Algorithm 4.
#pragma once

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

struct SmoothingOptions {
  int n_sweeps = 1;
  /// Moves that leave the smallest angle of the star below this bound and below what it was are
  /// rejected [degrees].
  double min_angle_deg = 20;
};

struct SmoothingReport {
  int n_moved = 0;     ///< accepted moves in all sweeps
  int n_rejected = 0;  ///< moves that would have turned over or sharpened a triangle
};

/// Gauss-Seidel sweeps over the vertices in the order of their handles. Vertex z moves to
///
///     z' = z^ + s n,   n = 1/6 sum_T a_T x b_T,   s = n . (z - z^) / |n|^2,
///
/// with z^ the average of the centroids of the star's triangles T = (z, a_T, b_T), weighted by
/// area. n is the gradient of the enclosed volume with respect to z, that is the area-weighted
/// normal of the star times a third of its area; it does not depend on where z is along
/// the star's tangents, and slivers weigh little in it. The volume is linear in z, so z' is the
/// one point of the line z^ + s n that keeps it, to rounding: relative 1e-12 in a sweep.
///
/// A vertex stays where it is if n nearly vanishes (|n| below 1 % of a third of the star's area: a
/// star folded onto itself has no normal), if a triangle of the star would turn by 90 degrees
/// or more, or by the bound on the angle.
SmoothingReport smooth(TriMesh& mesh, const SmoothingOptions& options = {});

}  // namespace surf::mesh
