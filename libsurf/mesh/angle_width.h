// Angle width control, thesis Algorithm 5.
#pragma once

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

struct AngleWidthOptions {
  double max_angle_deg = 120;  ///< thesis 4.1.3
  int n_smoothing_sweeps = 3;  ///< n_MS
  /// The loop as printed need not end: bisection leaves the angles of the closure's triangles, and
  /// smoothing may widen others. More rounds than these would only add triangles in one place.
  int max_rounds = 10;
};

struct AngleWidthReport {
  int n_rounds = 0;        ///< rounds that bisected something
  int n_new_vertices = 0;  ///< in all rounds
  int n_wide = 0;  ///< triangles still wider than the bound: > 0 only if max_rounds was reached
};

/// Bisects each triangle with an angle wider than the bound at its longest edge, which cuts that
/// angle at once (bisect_at_longest_edges()), then smooths (smoothing.h), until
/// there is none or the limit on rounds is reached. Keeps the volume.
AngleWidthReport control_angle_width(TriMesh& mesh, const AngleWidthOptions& options = {},
                                     const BisectionHook& hook = {});

}  // namespace surf::mesh
