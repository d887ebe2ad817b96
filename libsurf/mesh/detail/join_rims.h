// Joins what has grown on a grid to what stays of a surface. Private to surgery.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "libsurf/mesh/detail/connected_surface.h"
#include "libsurf/mesh/detail/grown_part.h"
#include "libsurf/mesh/detail/removal.h"

namespace surf::mesh {

/// Longest edge of faces near an event, in units of the resolution: larger ones have to be bisected
/// before.
constexpr double kLongestEdgeAtEvent = 2.5;

/// What takes the place of some triangles.
struct Patch {
  std::vector<int> removed;                   ///< triangles, ascending
  std::vector<Vector<3>> points;              ///< new vertices
  std::vector<std::array<int, 3>> triangles;  ///< vertices of the surface, then the new ones
};

struct JoinedRims {
  std::optional<Patch> patch;  ///< none where a rim has no partner
  /// Without a patch: triangles of the core in parts of the removal that no event is in.
  std::vector<int> without_event;
};

/// Pairs the rims of what is removed with the closest rims of what has grown, and fills the gap
/// between the two of each pair with a strip. Short rims without a partner are capped. Parts of the
/// removal that hang together with no event keep their triangles, and what has grown for them goes.
/// @param part           its first vertex is surface.n_vertices()
/// @param resolution_mm  spacing of the grid
JoinedRims join_rims(const ConnectedSurface& surface, const std::vector<int>& events,
                     RemovedTriangles removal, GrownPart part, double resolution_mm);

}  // namespace surf::mesh
