// Winding numbers of elements by exact rays, shared between sources of this library.
#pragma once

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <array>
#include <cmath>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactPoint = ExactKernel::Point_2;

inline ExactPoint exact_point(const Points<2>& points, int i) {
  return {points(i, 0), points(i, 1)};
}

/// Whether a piece goes rather along x than along y: rounded, so two calls may differ at 45
/// degrees.
inline bool is_flat(const ExactPoint& a, const ExactPoint& b) {
  return std::abs(CGAL::to_double(b.x() - a.x())) >= std::abs(CGAL::to_double(b.y() - a.y()));
}

/// Rays to the middle of a piece of an element, from below or from the left; the piece must not be
/// parallel to its ray. The elements that such rays may cross are found in columns across them: for
/// n elements O(n) to set up, and about the number of sheets that a ray crosses for each.
class WindingRays {
 public:
  /// Both must outlive this object.
  WindingRays(const Points<2>& points, const Elements<2>& elements);

  /// Calls visit(element, sign, is_on) for each element that the ray to the middle of the piece
  /// from a to b crosses before it, or that contains the middle; sign is +1 if the winding number
  /// grows there.
  template <class Visit>
  void for_each_crossed(const ExactPoint& a, const ExactPoint& b, bool from_below,
                        const Visit& visit);

  struct Sides {
    int right = 0, left = 0;
  };
  /// Winding numbers of all elements on both sides of the piece, which lies on an element and whose
  /// inside meets no others but such as contain it.
  Sides sides(const ExactPoint& a, const ExactPoint& b);

 private:
  struct Columns {
    double lower = 0, width = 1;
    std::vector<int> first, elements;  // of column c: elements[first[c] ... first[c + 1] - 1]
  };
  const Columns& columns(int axis);
  int column(const Columns& columns, double x) const;

  const Points<2>& points_;
  const Elements<2>& elements_;
  std::array<Columns, 2> columns_;
};

template <class Visit>
void WindingRays::for_each_crossed(const ExactPoint& a, const ExactPoint& b, bool from_below,
                                   const Visit& visit) {
  const int axis = from_below ? 0 : 1, along = 1 - axis;
  const ExactPoint middle = CGAL::midpoint(a, b);
  const auto [low, high] = CGAL::to_interval(middle[axis]);
  const double level_low = CGAL::to_interval(middle[along]).first,
               level_high = CGAL::to_interval(middle[along]).second;
  const Columns& all = columns(axis);
  const int c = column(all, (low + high) / 2);
  for (int k = all.first[c]; k < all.first[c + 1]; ++k) {
    const int e = all.elements[k], i = elements_(e, 0), j = elements_(e, 1);
    const double from = points_(i, axis), to = points_(j, axis);
    if (std::min(from, to) > high || std::max(from, to) < low || from == to) continue;
    // Half-open, so that of two elements with a common end on the ray one counts.
    const bool is_across = std::min(from, to) <= middle[axis] && middle[axis] < std::max(from, to);
    if (!is_across) continue;
    // Upwards through an element to the right, and rightwards through one that goes down, the left
    // side is entered.
    const int sign = (to > from) == (axis == 0) ? 1 : -1;
    const double bottom = std::min(points_(i, along), points_(j, along)),
                 top = std::max(points_(i, along), points_(j, along));
    if (top < level_low) {
      visit(e, sign, false);
    } else if (bottom <= level_high) {
      const auto side = CGAL::orientation(exact_point(points_, i), exact_point(points_, j), middle);
      // The middle is beyond the element as seen along the ray: on its left if sign is 1.
      if (side == CGAL::COLLINEAR)
        visit(e, sign, true);
      else if ((side == CGAL::LEFT_TURN) == (sign > 0))
        visit(e, sign, false);
    }
  }
}

}  // namespace surf::curve
