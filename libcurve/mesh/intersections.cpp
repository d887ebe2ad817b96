#include "libcurve/mesh/intersections.h"

#include <cassert>

#include "libcurve/mesh/detail/exact_segments.h"

namespace surf::curve {

std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements) {
  check_elements(points, elements);
  return intersections_by_boxes(points, elements, nullptr);
}

std::vector<ElementPair> intersections(const Points<2>& points, const Elements<2>& elements,
                                       const std::vector<char>& flagged) {
  check_elements(points, elements);
  assert(static_cast<Eigen::Index>(flagged.size()) == elements.rows());
  return intersections_by_boxes(points, elements, &flagged);
}

}  // namespace surf::curve
