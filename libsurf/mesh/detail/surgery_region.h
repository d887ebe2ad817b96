// The plan of one surgery: which triangles of a surface go, and what takes their place. Private to
// surgery.
#pragma once

#include <vector>

#include "libsurf/mesh/detail/connected_surface.h"
#include "libsurf/mesh/detail/join_rims.h"
#include "libsurf/mesh/detail/removal.h"

namespace surf::mesh {

struct RegionRequest {
  std::vector<int> events;  ///< triangles
  std::vector<int> others;  ///< triangles that belong to the region, wherever they are
  double reach_mm = 0;      ///< along the surface from the events; infinite: the whole components
};

struct RegionPlan {
  enum class State { kFits, kFails, kWantsMore };
  State state = State::kFails;
  Patch patch;
  /// Events of other regions that a phantom part of this one borders on, after kWantsMore; what
  /// else passes through the cells, after kFails.
  std::vector<int> wanted;
  bool is_large = false;  ///< the whole surface would be planned as fast
};

/// Plans the patch for a region of a surface, see operate(). That it does not intersect the rest is
/// not looked at.
/// @param large          of the surface and the events of the beginning
/// @param is_event       one flag per triangle: events of this region and others
/// @param resolution_mm  spacing of the grid
RegionPlan plan_region(const ConnectedSurface& surface, LargeParts& large,
                       const TriangleFlags& is_event, const RegionRequest& request,
                       double resolution_mm);

}  // namespace surf::mesh
