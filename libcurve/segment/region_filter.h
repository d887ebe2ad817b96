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

/// Something that went.
struct RemovedRegion {
  std::string what;                         ///< "filled hole", "small region", ...
  int n_curves = 1;                         ///< with the holes that went with a region
  double area_mm2 = 0;                      ///< of these curves, signed: negative for a hole
  Vector<2> center_mm = Vector<2>::Zero();  ///< of the outer curve's length
};

struct FilteredCurves {
  Segments curves;
  std::vector<RemovedRegion> removed;
};

/// @throws UsageError  filter.error() is not empty
FilteredCurves filtered(const Segments& curves, const RegionFilter& filter);

}  // namespace surf::curve
