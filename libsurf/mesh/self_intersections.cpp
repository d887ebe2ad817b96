#include "libsurf/mesh/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "libsurf/mesh/detail/close_pairs.h"

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
  Soup(const Points<3>& points, const Elements<3>& elements)
      : points_(points), elements_(elements) {}

  Point point(int row, int corner) const {
    const double* p = points_.data() + 3 * Eigen::Index(elements_(row, corner));
    return {p[0], p[1], p[2]};
  }

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
    const Point p = point(first, (apex + 1) % 3), q = point(first, (apex + 2) % 3),
                r = point(first, apex), s = point(second, other_apex);
    return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
  }

  const Points<3>& points_;
  const Elements<3>& elements_;
};

/// Tests with doubles that rule out an intersection for certain: what they compare differs by more
/// than the rounding errors, which are below a few 1e-16 of the products of the lengths involved.
class QuickTest {
 public:
  QuickTest(const Points<3>& points, const Elements<3>& elements)
      : points_(points), elements_(elements) {}

  bool is_surely_apart(int first, int second) const {
    const int* a = elements_.data() + 3 * Eigen::Index(first);
    const int* b = elements_.data() + 3 * Eigen::Index(second);
    int i_shared = 0, j_shared = 0, n_shared = 0, i_sum = 0, j_sum = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (a[i] == b[j]) {
          i_shared = i, j_shared = j;
          i_sum += i, j_sum += j;
          ++n_shared;
        }
    if (n_shared == 0) return is_apart(a, b);
    if (n_shared == 1) return meets_in_vertex(a, i_shared, b, j_shared);
    if (n_shared != 2 || names_a_vertex_twice(a) || names_a_vertex_twice(b)) return false;
    return is_unfolded(a, 3 - i_sum, b[3 - j_sum]);
  }

 private:
  using Vector3 = Eigen::Vector3d;
  static constexpr double kRounding = 1e-13;  // relative, with room

  Vector3 offset(int from, int to) const { return (points_.row(to) - points_.row(from)); }

  static bool names_a_vertex_twice(const int* t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
  }

  /// Are these values all above, or all below, what may be rounding?
  template <class... Values>
  static bool have_one_sign(double bound, Values... values) {
    return ((values > bound) && ...) || ((values < -bound) && ...);
  }

  /// No common vertex: the plane of one, or one across the line of the centroids, parts them.
  bool is_apart(const int* a, const int* b) const {
    const Vector3 a1 = offset(a[0], a[1]), a2 = offset(a[0], a[2]);
    const Vector3 b0 = offset(a[0], b[0]), b1 = offset(a[0], b[1]), b2 = offset(a[0], b[2]);
    const double size = std::sqrt(std::max({a1.squaredNorm(), a2.squaredNorm(), b0.squaredNorm(),
                                            b1.squaredNorm(), b2.squaredNorm()}));
    const double bound = 10 * kRounding * size * size * size;
    const Vector3 n = a1.cross(a2);
    if (have_one_sign(bound, n.dot(b0), n.dot(b1), n.dot(b2))) return true;
    const Vector3 m = (b1 - b0).cross(b2 - b0);
    const double d = m.dot(b0);
    if (have_one_sign(bound, d, d - m.dot(a1), d - m.dot(a2))) return true;
    const Vector3 line = b0 + b1 + b2 - a1 - a2;
    const double least = std::min({line.dot(b0), line.dot(b1), line.dot(b2)});
    const double most = std::max({0.0, line.dot(a1), line.dot(a2)});
    return least - most > 10 * kRounding * size * size;
  }

  /// One common vertex: the corners opposite it lie on one side of the other's plane, or a plane
  /// through the vertex parts the two.
  bool meets_in_vertex(const int* a, int i, const int* b, int j) const {
    const int vertex = a[i];
    const Vector3 a1 = offset(vertex, a[(i + 1) % 3]), a2 = offset(vertex, a[(i + 2) % 3]);
    const Vector3 b1 = offset(vertex, b[(j + 1) % 3]), b2 = offset(vertex, b[(j + 2) % 3]);
    const Vector3 u = a1 + a2, v = b1 + b2;
    const double squared =
        std::max({a1.squaredNorm(), a2.squaredNorm(), b1.squaredNorm(), b2.squaredNorm()});
    const Vector3 across = v.norm() * u - u.norm() * v;
    const double size = std::sqrt(squared), bound = 10 * kRounding * squared * size;
    const double a_least = std::min(across.dot(a1), across.dot(a2));
    const double b_most = std::max(across.dot(b1), across.dot(b2));
    if (a_least > bound && b_most < -bound) return true;
    const Vector3 n = a1.cross(a2), m = b1.cross(b2);
    return have_one_sign(bound, n.dot(b1), n.dot(b2)) || have_one_sign(bound, m.dot(a1), m.dot(a2));
  }

  /// A common edge: the apexes lie on two sides of it, or out of one plane.
  bool is_unfolded(const int* a, int apex, int other_apex) const {
    const int p = a[(apex + 1) % 3], q = a[(apex + 2) % 3];
    const Vector3 edge = offset(p, q), r = offset(p, a[apex]), s = offset(p, other_apex);
    const double squared = std::max({edge.squaredNorm(), r.squaredNorm(), s.squaredNorm()});
    const Vector3 n = edge.cross(r), m = edge.cross(s);
    return n.dot(m) < -10 * kRounding * squared * squared ||
           std::abs(n.dot(s)) > 10 * kRounding * squared * std::sqrt(squared);
  }

  const Points<3>& points_;
  const Elements<3>& elements_;
};

/// Marks vertices whose triangles, seen along their mean normal, lie once round the vertex, each
/// with its outside towards the eye: then they meet in the sides they share only. As QuickTest,
/// certain but not complete.
class PlainStars {
 public:
  PlainStars(const Points<3>& X, const Elements<3>& T)
      : elements_(T), stars_(X.rows()), is_plain_(X.rows()) {
    for (Eigen::Index t = 0; t < T.rows(); ++t) add_normal(X, T.row(t));
    for (Star& star : stars_) star.across = star.normal.unitOrthogonal();
    for (Eigen::Index t = 0; t < T.rows(); ++t)
      for (int i = 0; i < 3; ++i) add_corner(X, T(t, i), T(t, (i + 1) % 3), T(t, (i + 2) % 3));
    for (std::size_t i = 0; i < stars_.size(); ++i)
      is_plain_[i] = stars_[i].faces_eye && stars_[i].n_turns == 1 && stars_[i].ends == 0;
  }

  bool have_common(int first, int second) const {
    const int* a = elements_.data() + 3 * Eigen::Index(first);
    const int* b = elements_.data() + 3 * Eigen::Index(second);
    const auto is_common = [&](int i) {
      return bool((a[i] == b[0]) | (a[i] == b[1]) | (a[i] == b[2])) & bool(is_plain_[a[i]]);
    };
    return bool(int(is_common(0)) | int(is_common(1)) | int(is_common(2)));
  }

 private:
  struct Star {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d across;  // to the normal
    std::uint64_t ends = 0;  // 0 if each spoke ends one triangle and begins another
    int n_turns = 0;         // how often the triangles pass, counter-clockwise, a ray
    bool faces_eye = true;   // all triangles
  };

  void add_normal(const Points<3>& X, const Eigen::RowVector3i& t) {
    const Eigen::Vector3d a = X.row(t[1]) - X.row(t[0]), b = X.row(t[2]) - X.row(t[0]);
    const Eigen::Vector3d normal = a.cross(b);
    for (int i = 0; i < 3; ++i) stars_[t[i]].normal += normal;
  }

  void add_corner(const Points<3>& X, int vertex, int next, int previous) {
    constexpr double kLeastSine = 1e-9;  // of the angle seen; above what rounding may hide
    Star& star = stars_[vertex];
    const Eigen::Vector3d u = X.row(next) - X.row(vertex), w = X.row(previous) - X.row(vertex);
    const double bound = kLeastSine * (u.squaredNorm() + w.squaredNorm()) * star.normal.norm();
    star.faces_eye &= u.cross(w).dot(star.normal) > bound;
    star.n_turns += u.dot(star.across) < 0 && w.dot(star.across) >= 0;
    star.ends += scattered(next) - scattered(previous);
  }

  /// A number of 64 bits for each vertex, so that sums of them vanish only if all terms cancel.
  static std::uint64_t scattered(int vertex) {
    std::uint64_t z = (std::uint64_t(vertex) + 1) * 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    return z ^ (z >> 27);
  }

  const Elements<3>& elements_;
  std::vector<Star> stars_;
  std::vector<char> is_plain_;
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

/// Those of the pairs that do intersect, in ascending order.
std::vector<Pair> intersecting(const Soup& soup, std::vector<Pair> pairs) {
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

/// Pairs with an active triangle that the quick test leaves open, none degenerate.
std::vector<Pair> pairs_in_contact(const Soup& soup, const PlainStars& stars,
                                   const QuickTest& quick, const std::vector<char>& active,
                                   const RowGrid& grid) {
  std::vector<std::vector<Pair>> found(grid.n_rows());
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.n_rows(), 8), [&](const auto& range) {
    for (int row = range.begin(); row < range.end(); ++row)
      grid.for_each_pair(row, [&](int a, int b) {
        if ((active[a] || active[b]) && !stars.have_common(a, b) && !quick.is_surely_apart(a, b))
          found[row].push_back(std::minmax(a, b));
      });
  });
  std::vector<Pair> pairs;
  for (const auto& list : found)
    std::copy_if(list.begin(), list.end(), std::back_inserter(pairs), [&](const Pair& pair) {
      return !soup.is_degenerate(pair.first) && !soup.is_degenerate(pair.second);
    });
  return pairs;
}

double largest_radius(const std::vector<BoundingBall>& balls) {
  double largest = 0;
  for (const BoundingBall& ball : balls) largest = std::max(largest, ball.radius);
  return largest;
}

/// Are the triangles of about one size, so that few lie within reach of each other?
bool is_even(const std::vector<BoundingBall>& balls, double reach) {
  constexpr double kUneven = 4;
  double sum = 0;
  for (const BoundingBall& ball : balls) sum += ball.radius;
  return reach > 0 && reach <= kUneven * 2 * sum / double(balls.size());
}

std::vector<Pair> pairs_with_active(const Points<3>& points, const Elements<3>& elements,
                                    const std::vector<char>& active,
                                    const std::vector<BoundingBall>& balls) {
  const Soup soup(points, elements);
  const double reach = 2 * largest_radius(balls);
  if (is_even(balls, reach))
    return intersecting(
        soup, pairs_in_contact(soup, PlainStars(points, elements), QuickTest(points, elements),
                               active, RowGrid(balls, reach)));
  std::vector<Pair> pairs = pairs_with_common_box(soup, elements.rows());
  std::erase_if(pairs, [&](const Pair& p) { return !active[p.first] && !active[p.second]; });
  return intersecting(soup, std::move(pairs));
}

/// Triangles, in ascending order, in the cells with an active one or next to them; by chance a few
/// more, since cells share flags.
std::vector<int> near_active(const std::vector<BoundingBall>& balls,
                             const std::vector<char>& active, std::size_t n_active) {
  const double cell = 2 * largest_radius(balls) * (1 + 1e-9);
  const std::size_t last = std::bit_ceil(64 * n_active) - 1;
  std::vector<char> is_near(last + 1);
  const auto cell_of = [&](const BoundingBall& ball) {
    return (ball.center / cell).array().floor().cast<std::int64_t>().eval();
  };
  const auto flag = [&](std::int64_t x, std::int64_t y, std::int64_t z) -> char& {
    const std::uint64_t key = std::uint64_t(x) * 0x9e3779b97f4a7c15 +
                              std::uint64_t(y) * 0xbf58476d1ce4e5b9 +
                              std::uint64_t(z) * 0x94d049bb133111eb;
    return is_near[(key ^ (key >> 32)) & last];
  };
  for (std::size_t row = 0; row < balls.size(); ++row) {
    if (!active[row]) continue;
    const auto at = cell_of(balls[row]);
    for (int k = 0; k < 27; ++k)
      flag(at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1) = 1;
  }
  std::vector<int> rows;
  for (std::size_t row = 0; row < balls.size(); ++row) {
    const auto at = cell_of(balls[row]);
    if (flag(at[0], at[1], at[2])) rows.push_back(static_cast<int>(row));
  }
  return rows;
}

template <class T>
std::vector<T> picked(const std::vector<T>& all, const std::vector<int>& rows) {
  std::vector<T> some;
  some.reserve(rows.size());
  for (const int row : rows) some.push_back(all[row]);
  return some;
}

Elements<3> picked(const Elements<3>& all, const std::vector<int>& rows) {
  return all(rows, Eigen::all);
}

}  // namespace

std::vector<std::pair<int, int>> self_intersections(const Triangles& surface) {
  return self_intersections(surface.points, surface.elements,
                            std::vector<char>(surface.elements.rows(), 1));
}

std::vector<std::pair<int, int>> self_intersections(const Points<3>& points,
                                                    const Elements<3>& elements,
                                                    const std::vector<char>& active) {
  const auto n_active = std::count(active.begin(), active.end(), 1);
  if (n_active == 0) return {};
  const std::vector<BoundingBall> balls = bounding_balls(points, elements);
  constexpr int kFew = 4;
  if (kFew * n_active > elements.rows()) return pairs_with_active(points, elements, active, balls);
  const std::vector<int> rows = near_active(balls, active, n_active);
  std::vector<Pair> pairs =
      pairs_with_active(points, picked(elements, rows), picked(active, rows), picked(balls, rows));
  for (auto& [first, second] : pairs) first = rows[first], second = rows[second];
  return pairs;
}

bool do_intersect(const Points<3>& points, const Elements<3>& elements, int first, int second) {
  return Soup(points, elements).intersect(first, second);
}

std::vector<char> changed_triangles(const Triangles& before, const Triangles& after) {
  std::vector<char> changed(after.elements.rows(), 1);
  const Eigen::Index n = std::min(before.elements.rows(), after.elements.rows());
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto corner = [row](const Triangles& surface, int i) {
      return surface.points.row(surface.elements(row, i));
    };
    for (int turn = 0; turn < 3 && changed[row]; ++turn)
      changed[row] = corner(before, 0) != corner(after, turn) ||
                     corner(before, 1) != corner(after, (turn + 1) % 3) ||
                     corner(before, 2) != corner(after, (turn + 2) % 3);
  }
  return changed;
}

std::vector<std::pair<int, int>> added_intersections(const Triangles& before,
                                                     const Triangles& after) {
  auto now = self_intersections(after.points, after.elements, changed_triangles(before, after));
  if (!now.empty() && now.size() <= self_intersections(before).size()) now.clear();
  return now;
}

std::vector<int> degenerate_triangles(const Triangles& surface) {
  const Soup soup(surface.points, surface.elements);
  std::vector<int> result;
  for (int row = 0; row < surface.elements.rows(); ++row)
    if (soup.is_degenerate(row)) result.push_back(row);
  return result;
}

}  // namespace surf::mesh
