#include <algorithm>

#include "libcurve/mesh/detail/box_tree.h"
#include "libcurve/mesh/detail/exact_segments.h"
#include "libcurve/mesh/intersections.h"

namespace surf::curve {
namespace {

bool share_a_node(const Elements<2>& elements, int e, int f) {
  return elements(e, 0) == elements(f, 0) || elements(e, 0) == elements(f, 1) ||
         elements(e, 1) == elements(f, 0) || elements(e, 1) == elements(f, 1);
}

template <class Accept>
std::vector<ElementPair> sorted_pairs(const Points<2>& points, const Elements<2>& elements,
                                      double margin, const Accept& accept) {
  std::vector<ElementPair> out;
  BoxTree(points, elements, margin).for_each_pair([&](int e, int f) {
    if (accept(e, f)) out.emplace_back(std::min(e, f), std::max(e, f));
  });
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

std::vector<ElementPair> intersections_by_boxes(const Points<2>& points,
                                                const Elements<2>& elements,
                                                const std::vector<char>* flagged) {
  return sorted_pairs(points, elements, 0, [&](int e, int f) {
    return (!flagged || (*flagged)[e] || (*flagged)[f]) && do_meet(points, elements, e, f);
  });
}

std::vector<ElementPair> near_pairs(const Points<2>& points, const Elements<2>& elements,
                                    double distance) {
  check_elements(points, elements);
  return sorted_pairs(points, elements, distance,
                      [&](int e, int f) { return !share_a_node(elements, e, f); });
}

}  // namespace surf::curve
