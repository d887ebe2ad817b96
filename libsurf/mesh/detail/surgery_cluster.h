// Events whose regions are rebuilt together, and the surface with what is built. Private to
// surgery.
#pragma once

#include <optional>
#include <vector>

#include "libsurf/mesh/detail/surgery_region.h"

namespace surf::mesh {

struct Cluster {
  std::vector<int> events;
  std::vector<int> others;  // see RegionRequest
  int n_failures = 0, n_growths = 0;
  bool is_planned = false;
  Patch patch;
  std::optional<RegionPlan> ahead = {};  // made ahead of its turn
};

/// The surface with all patches.
struct PatchedSurface {
  Points<3> points;
  Elements<3> elements;
  std::vector<int> owner;  // cluster of each triangle, -1 for those that stay
  std::vector<int> kept;   // number of those that stay, which are the first ones
};

PatchedSurface patched(const ConnectedSurface& surface, const std::vector<Cluster>& clusters);

/// Flags clusters with a side that another triangle runs through the same way, or whose two ends
/// are an edge of the rest already.
void mark_crowded_edges(const PatchedSurface& all, std::vector<char>& is_bad);

}  // namespace surf::mesh
