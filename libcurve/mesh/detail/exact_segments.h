// Exact predicates on elements, shared between sources of this library.
#pragma once

#include <vector>

#include "libcurve/mesh/intersections.h"
#include "libsurf/base/types.h"

namespace surf::curve {

/// @throws InvalidMesh  an element names a point that is missing or not finite
void check_elements(const Points<2>& points, const Elements<2>& elements);

/// Whether two elements meet in the sense of intersections(). Exact.
bool do_meet(const Points<2>& points, const Elements<2>& elements, int e, int f);

std::vector<ElementPair> intersections_by_boxes(const Points<2>& points,
                                                const Elements<2>& elements,
                                                const std::vector<char>* flagged);

}  // namespace surf::curve
