// Space adaptivity of a surface, thesis 4.2: bisection where geometry or data want more elements,
// bisections undone where fewer do.
#pragma once

#include <stop_token>
#include <vector>

#include "libsurf/fem/adaptivity.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

using AdaptivityOptions = fem::AdaptivityOptions<3>;
using fem::adaptivity_marks;

struct AdaptivityReport : fem::AdaptivityReport {
  /// Faces still marked for coarsening after bisections were undone, one flag per face: what
  /// ImproveOptions::may_coarsen takes.
  std::vector<char> may_coarsen;
};

/// Marks, bisects marked faces up to d - 1 = 2 times, the second time where they are still marked
/// (by then their indicators have about halved), and undoes up to two bisections where all four
/// faces of a vertex are marked, until nothing changes or for max_rounds rounds.
///
/// Alg. 6 as printed can refine and coarsen for ever. Here a bisection is undone only if the two
/// faces that come back would not be marked for refinement: their h_S theta_S is computed, and the
/// error of a quadrature is taken to grow by 8 at most.
///
/// Vertices stay where they are and new ones stand at midpoints; the surface is changed by the
/// undone bisections alone, of which none turns a face by more than 60 degrees.
///
/// @param stop  ends it before the next round
AdaptivityReport adapt(TriMesh& mesh, const AdaptivityOptions& options, int max_rounds = 30,
                       const std::stop_token& stop = {});

}  // namespace surf::mesh
