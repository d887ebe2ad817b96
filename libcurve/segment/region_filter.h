// Which regions of a set of curves stay.
#pragma once

#include <string>
#include <vector>

#include "libsurf/mesh/hierarchy.h"

namespace surf::curve {

/// What stays of the final curves: regions, in this order.
struct RegionFilter {
  bool fill_holes = false;  ///< first: holes go, with all that lies in them
  double min_area_mm2 = 0;  ///< then regions of less, with their holes
  mesh::Keep keep = mesh::Keep::kAll;
  std::vector<Vector<2>> seeds_mm;  ///< for kSeeded: regions that contain one; not in a hole

  std::string error() const;  ///< empty if valid
};

/// @param n_removed  regions and holes that went
/// @throws UsageError  filter.error() is not empty
Segments filtered(const Segments& curves, const RegionFilter& filter, int& n_removed);

}  // namespace surf::curve
