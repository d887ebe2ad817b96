#include "libsurf/mesh/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>

namespace surf::mesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;
using Pair = std::pair<int, int>;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int,
                                                      CGAL::Box_intersection_d::ID_EXPLICIT>;

class Soup {
 public:
  explicit Soup(const Triangles& surface) : elements_(surface.elements) {
    points_.reserve(surface.points.rows());
    for (const auto point : surface.points.rowwise())
      points_.emplace_back(point[0], point[1], point[2]);
  }

  const Point& point(int row, int corner) const { return points_[elements_(row, corner)]; }

  bool is_degenerate(int row) const {
    return CGAL::collinear(point(row, 0), point(row, 1), point(row, 2));
  }

  CGAL::Bbox_3 bbox(int row) const {
    return point(row, 0).bbox() + point(row, 1).bbox() + point(row, 2).bbox();
  }

  bool intersect(int first, int second) const {
    int shared[3][2], n_shared = 0;  // corners of first and second
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (elements_(first, i) == elements_(second, j)) {
          shared[n_shared][0] = i;
          shared[n_shared++][1] = j;
        }
    switch (n_shared) {
      case 0:
        return CGAL::do_intersect(triangle(first), triangle(second));
      case 1:
        return CGAL::do_intersect(triangle(first), opposite(second, shared[0][1])) ||
               CGAL::do_intersect(triangle(second), opposite(first, shared[0][0]));
      case 2:
        return is_folded(first, 3 - shared[0][0] - shared[1][0], second,
                         3 - shared[0][1] - shared[1][1]);
      default:
        return true;  // the same triangle twice
    }
  }

 private:
  Triangle triangle(int row) const { return {point(row, 0), point(row, 1), point(row, 2)}; }
  Segment opposite(int row, int corner) const {
    return {point(row, (corner + 1) % 3), point(row, (corner + 2) % 3)};
  }
  /// Two triangles with a common edge, both on the same side of it in one plane.
  bool is_folded(int first, int apex, int second, int other_apex) const {
    const Point &p = point(first, (apex + 1) % 3), &q = point(first, (apex + 2) % 3),
                &r = point(first, apex), &s = point(second, other_apex);
    return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
  }

  const Elements<3>& elements_;
  std::vector<Point> points_;
};

std::vector<Pair> pairs_with_common_box(const Soup& soup, Eigen::Index n) {
  std::vector<Box> boxes;
  boxes.reserve(n);
  for (int row = 0; row < n; ++row)
    if (!soup.is_degenerate(row)) boxes.emplace_back(soup.bbox(row), row);
  std::vector<const Box*> pointers;
  pointers.reserve(boxes.size());
  for (const Box& box : boxes) pointers.push_back(&box);
  std::vector<Pair> pairs;
  constexpr std::ptrdiff_t kCutoff = 2000;  // as in CGAL's self_intersections
  CGAL::box_self_intersection_d(
      pointers.begin(), pointers.end(),
      [&](const Box* a, const Box* b) { pairs.push_back(std::minmax(a->info(), b->info())); },
      kCutoff);
  return pairs;
}

}  // namespace

std::vector<std::pair<int, int>> self_intersections(const Triangles& surface) {
  const Soup soup(surface);
  std::vector<Pair> pairs = pairs_with_common_box(soup, surface.elements.rows());
  std::vector<std::uint8_t> does_intersect(pairs.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pairs.size(), 1024), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      does_intersect[i] = soup.intersect(pairs[i].first, pairs[i].second);
  });
  std::size_t n = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (does_intersect[i]) pairs[n++] = pairs[i];
  pairs.resize(n);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

std::vector<int> degenerate_triangles(const Triangles& surface) {
  const Soup soup(surface);
  std::vector<int> result;
  for (int row = 0; row < surface.elements.rows(); ++row)
    if (soup.is_degenerate(row)) result.push_back(row);
  return result;
}

}  // namespace surf::mesh
