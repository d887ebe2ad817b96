// Topology surgery on a triangle surface: where it meets or crosses itself it is rebuilt as the
// boundary of the domain round which it winds.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "libsurf/flow/moving_shape.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

struct SurgeryOptions {
  /// Topology resolution [mm], > 0: the spacing of the grid on which the domain is sampled. Within
  /// about two spacings of an event gaps and walls thinner than two spacings are closed and cut.
  double resolution_mm = 0;
  /// Patches that intersect others grow there, four times. If that does not help, and where nothing
  /// fits, they are tried again with 1.6 times the reach, three times, then with what they came to
  /// intersect as further events, and at last with the whole components; these come next where what
  /// does not fit is a region of more than 4,000 triangles and 2 % of the surface.
  int max_attempts = 7;
  /// Largest genus of a shell of the result: regions that would give one more handles are refused,
  /// those before them in the list stand.
  int max_genus = std::numeric_limits<int>::max();

  std::string error() const;  ///< empty if valid
};

using flow::TopologyChange;

/// One rebuilt region of a surface.
struct RebuiltRegion {
  TopologyChange change = TopologyChange::kUntangling;
  Eigen::Vector3d place;  ///< centre of the triangles that asked for it [mm]
  int n_events = 0;       ///< these triangles
  int n_removed = 0;      ///< triangles of the old surface
  int n_added = 0;        ///< triangles of the patch
  double volume_change_mm3 = 0;
  bool is_whole = false;  ///< whole components had to be rebuilt
};

struct SurgeryReport {
  std::vector<RebuiltRegion> regions;
  /// Places where nothing fits, not even whole components; then nothing was rebuilt.
  int n_unresolved = 0;
  /// Flags of the faces, as they are numbered now, whose events were refused because of max_genus;
  /// empty if none.
  std::vector<char> refused;
};

/// Rebuilds a closed surface near the faces flagged as events: triangles that intersect others,
/// pairs that come close. With the winding number w of the whole surface the domain is {w >= 1},
/// whatever the surface went through; what is inverted or covered twice goes (thesis 4.3.7 for
/// curves).
///
/// Near the events, faces are first bisected down to the resolution (Alg. 11). The domain is
/// sampled on a grid of cubic cells, thin gaps and walls are removed, and the cells that the
/// surface meets within two spacings of them are filled by marching cubes with vertices on
/// the surface itself. A strip of triangles joins this patch to the rest, which stays as it is, bit
/// for bit. A patch is accepted only if it closes the surface without an intersection of its own.
///
/// Parts of the surface that lie wholly inside or outside the domain and meet no event (a shell in
/// a shell) are left: see hierarchy.h.
///
/// Handles die. Faces of patches are marked at their longest edges, other marks and the history of
/// bisections are kept. Deterministic.
/// @param events  one flag per face
/// @throws UsageError  options.error() is not empty
/// @param hook  of the bisections
SurgeryReport operate(TriMesh& mesh, std::vector<char> events, const SurgeryOptions& options,
                      const BisectionHook& hook = {});

}  // namespace surf::mesh
