#include "libcurve/mesh/detail/exact_segments.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <fmt/format.h>

#include <cmath>

#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_2;

Point point(const Points<2>& points, int i) { return {points(i, 0), points(i, 1)}; }

/// In the box of a segment that is collinear with it: on it.
bool is_between(const Point& a, const Point& b, const Point& p) {
  return CGAL::compare_xy(a, p) != CGAL::compare_xy(b, p) || p == a || p == b;
}

bool do_intersect(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto c_side = CGAL::orientation(a, b, c), d_side = CGAL::orientation(a, b, d);
  if (c_side == d_side && c_side != CGAL::COLLINEAR) return false;
  if (c_side == CGAL::COLLINEAR && d_side == CGAL::COLLINEAR && a != b)
    return is_between(a, b, c) || is_between(a, b, d) || is_between(c, d, a);
  const auto a_side = CGAL::orientation(c, d, a), b_side = CGAL::orientation(c, d, b);
  if (a_side == b_side && a_side != CGAL::COLLINEAR) return false;
  if (a == b) return a_side == CGAL::COLLINEAR && is_between(c, d, a);
  if (c == d) return c_side == CGAL::COLLINEAR && is_between(a, b, c);
  return true;
}

/// Of segments from a common end: b and c lie on one side of it.
bool fold_back(const Point& common, const Point& b, const Point& c) {
  return b != common && c != common && CGAL::collinear(common, b, c) &&
         CGAL::compare_xy(common, b) == CGAL::compare_xy(common, c);
}

}  // namespace

void check_elements(const Points<2>& points, const Elements<2>& elements) {
  for (Eigen::Index e = 0; e < elements.rows(); ++e)
    for (int i = 0; i < 2; ++i) {
      const int node = elements(e, i);
      if (node < 0 || node >= points.rows())
        throw InvalidMesh(
            fmt::format("element {} of a curve names node {} of {}", e, node, points.rows()));
      if (!std::isfinite(points(node, 0)) || !std::isfinite(points(node, 1)))
        throw InvalidMesh(fmt::format("node {} of a curve is not finite", node));
    }
}

bool do_meet(const Points<2>& points, const Elements<2>& elements, int e, int f) {
  const int a = elements(e, 0), b = elements(e, 1), c = elements(f, 0), d = elements(f, 1);
  const auto at = [&](int i) { return point(points, i); };
  if ((a == c && b == d) || (a == d && b == c)) return at(a) != at(b);
  if (b == c) return fold_back(at(b), at(a), at(d));
  if (a == d) return fold_back(at(a), at(b), at(c));
  if (a == c) return fold_back(at(a), at(b), at(d));
  if (b == d) return fold_back(at(b), at(a), at(c));
  return do_intersect(at(a), at(b), at(c), at(d));
}

}  // namespace surf::curve
