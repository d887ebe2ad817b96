// Feret diameters: how far a caliper opens round a surface.
#pragma once

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Largest and smallest distance of two parallel planes that hold the surface between them.
struct FeretDiameters {
  double largest_mm = 0;   ///< that of the two points which are farthest apart
  double smallest_mm = 0;  ///< the width of the convex hull
  Vector<3> largest_from_mm = Vector<3>::Zero(), largest_to_mm = Vector<3>::Zero();  ///< RAS
  Vector<3> smallest_direction =
      Vector<3>::Zero();  ///< of length 1; its largest component is positive
};

/// Both are exact on the convex hull but for rounding. The largest is that of two vertices. The
/// smallest lies between a face and a vertex, or between two edges (Houle and Toussaint, Computing
/// the width of a set, IEEE PAMI 10, 1988); round each edge of the hull the support on the other
/// side is followed from one of its faces to the other. The smallest and its direction are rounded
/// to 9 decimals, so that they do not depend on how the hull was found.
/// @throws InvalidMesh  the points lie in a plane
FeretDiameters feret_diameters(const Triangles& surface);

}  // namespace surf::mesh
