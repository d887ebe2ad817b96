#include "libsurf/mesh/point_obstacles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libsurf/mesh/detail/ray_crossings.h"

namespace surf::mesh {
namespace {

constexpr double kRounding = 1e-9;  // of the radius: that bisection rounds midpoints is no approach
constexpr double kPushed = 1.01;    // radii: how far an element is moved out
constexpr double kPart = 1.0 / 3;   // of the radius: of a step
constexpr double kLongest = 1.0 / 2;  // likewise, of a vertex that catches up
constexpr int kSweeps = 40;

/// The place of a simplex nearest to the origin, as weights of its corners.
Vector<2> nearest_weights(const Eigen::Matrix2d& corners) {
  const Vector<2> a = corners.row(0), side = corners.row(1).transpose() - a;
  const double squared = side.squaredNorm();
  const double at = squared > 0 ? std::clamp(-a.dot(side) / squared, 0.0, 1.0) : 0;
  return {1 - at, at};
}
Vector<3> nearest_weights(const Eigen::Matrix3d& corners) {
  const Vector<3> a = corners.row(0), b = corners.row(1), c = corners.row(2);
  const Vector<3> ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double squared = normal.squaredNorm();
  if (squared > 0) {
    const double at_b = normal.dot(ac.cross(a)) / squared, at_c = normal.dot(a.cross(ab)) / squared;
    if (at_b >= 0 && at_c >= 0 && at_b + at_c <= 1) return {1 - at_b - at_c, at_b, at_c};
  }
  Vector<3> best(1, 0, 0);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Vector<3> p = corners.row(i), side = corners.row(j).transpose() - p;
    const double length = side.squaredNorm();
    const double at = length > 0 ? std::clamp(-p.dot(side) / length, 0.0, 1.0) : 0;
    const double distance = (p + at * side).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    best.setZero();
    best[i] = 1 - at;
    best[j] += at;
  }
  return best;
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> corners_of(const Points<Dim>& X, const Elements<Dim>& T,
                                           Eigen::Index t) {
  Eigen::Matrix<double, Dim, Dim> out;
  for (int i = 0; i < Dim; ++i) out.row(i) = X.row(T(t, i));
  return out;
}

/// From a point to the nearest place of an element.
template <int Dim>
struct Reach {
  Vector<Dim> weights, way;
  double distance;

  Reach(const Points<Dim>& X, const Elements<Dim>& T, Eigen::Index t, const Vector<Dim>& point) {
    const Eigen::Matrix<double, Dim, Dim> corners =
        corners_of<Dim>(X, T, t).rowwise() - point.transpose();
    weights = nearest_weights(corners);
    way = corners.transpose() * weights;
    distance = way.norm();
  }
};

}  // namespace

template <>
std::vector<char> are_inside<3>(const Triangles& shape, const Points<3>& points) {
  std::vector<int> winding(std::size_t(points.rows()), 0);
  for (const RayCrossing& crossing : ray_crossings(shape, points))
    winding[crossing.ray] += crossing.sign;
  std::vector<char> out;
  for (const int n : winding) out.push_back(n >= 1);
  return out;
}

/// By rays along +x with half-open rules.
template <>
std::vector<char> are_inside<2>(const Segments& shape, const Points<2>& points) {
  std::vector<int> order(std::size_t(points.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return points(a, 1) < points(b, 1); });
  std::vector<int> winding(order.size(), 0);
  for (const auto e : shape.elements.rowwise()) {
    const bool is_upwards = shape.points(e[0], 1) < shape.points(e[1], 1);
    const auto low = shape.points.row(e[is_upwards ? 0 : 1]),
               high = shape.points.row(e[is_upwards ? 1 : 0]);
    auto at = std::lower_bound(order.begin(), order.end(), low[1],
                               [&](int ray, double y) { return points(ray, 1) < y; });
    for (; at != order.end() && points(*at, 1) < high[1]; ++at) {
      const double share = (points(*at, 1) - low[1]) / (high[1] - low[1]);
      if (low[0] + share * (high[0] - low[0]) > points(*at, 0)) winding[*at] += is_upwards ? 1 : -1;
    }
  }
  std::vector<char> out;
  for (const int n : winding) out.push_back(n >= 1);
  return out;
}

template <int Dim>
PointObstacles<Dim>::PointObstacles(std::vector<Vector<Dim>> points, double distance_mm,
                                    const std::optional<ImageBox<Dim>>& box)
    : points_(std::move(points)), tree_(points_.size()), distance_mm_(distance_mm), box_(box) {
  std::iota(tree_.begin(), tree_.end(), 0);
  sort(0, tree_.size(), 0);
}

template <int Dim>
void PointObstacles<Dim>::sort(std::size_t begin, std::size_t end, int axis) {
  if (end - begin < 2) return;
  const std::size_t middle = (begin + end) / 2;
  std::nth_element(tree_.begin() + std::ptrdiff_t(begin), tree_.begin() + std::ptrdiff_t(middle),
                   tree_.begin() + std::ptrdiff_t(end), [&](int a, int b) {
                     return std::pair(points_[a][axis], a) < std::pair(points_[b][axis], b);
                   });
  sort(begin, middle, (axis + 1) % Dim);
  sort(middle + 1, end, (axis + 1) % Dim);
}

template <int Dim>
template <class Visit>
void PointObstacles<Dim>::for_each_in(const Vector<Dim>& low, const Vector<Dim>& high,
                                      const Visit& visit) const {
  for_each_in(low, high, 0, tree_.size(), 0, visit);
}

template <int Dim>
template <class Visit>
void PointObstacles<Dim>::for_each_in(const Vector<Dim>& low, const Vector<Dim>& high,
                                      std::size_t begin, std::size_t end, int axis,
                                      const Visit& visit) const {
  if (begin >= end) return;
  const std::size_t middle = (begin + end) / 2;
  const Vector<Dim>& point = points_[tree_[middle]];
  if (low[axis] <= point[axis]) for_each_in(low, high, begin, middle, (axis + 1) % Dim, visit);
  if ((low.array() <= point.array()).all() && (point.array() <= high.array()).all())
    visit(tree_[middle]);
  if (point[axis] <= high[axis]) for_each_in(low, high, middle + 1, end, (axis + 1) % Dim, visit);
}

template <int Dim>
bool PointObstacles<Dim>::is_near(const Eigen::Matrix<double, Dim, Dim>& corners,
                                  double margin_mm) const {
  bool is_any = false;
  for_each_in(corners.colwise().minCoeff().transpose().array() - margin_mm,
              corners.colwise().maxCoeff().transpose().array() + margin_mm,
              [&](int) { is_any = true; });
  return is_any;
}

template <int Dim>
bool PointObstacles<Dim>::is_lid(const Points<Dim>& X, const Elements<Dim>& T,
                                 Eigen::Index t) const {
  if (!box_) return false;
  std::uint8_t faces = 0xff;
  for (int i = 0; i < Dim; ++i) faces &= box_->faces(X.row(T(t, i)).transpose());
  return faces != 0;
}

/// Elements and points that lie within the margin of the boxes of their ways, ascending.
template <int Dim>
std::vector<typename PointObstacles<Dim>::Pair> PointObstacles<Dim>::pairs_near(
    const Points<Dim>& from, const Points<Dim>& to, const Elements<Dim>& T,
    double margin_mm) const {
  std::vector<Pair> out;
  if (empty()) return out;
  std::vector<int> points;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const auto a = corners_of<Dim>(from, T, t), b = corners_of<Dim>(to, T, t);
    points.clear();
    for_each_in(
        a.colwise().minCoeff().cwiseMin(b.colwise().minCoeff()).transpose().array() - margin_mm,
        a.colwise().maxCoeff().cwiseMax(b.colwise().maxCoeff()).transpose().array() + margin_mm,
        [&](int point) { points.push_back(point); });
    if (points.empty() || is_lid(from, T, t)) continue;
    std::sort(points.begin(), points.end());
    for (const int point : points) out.push_back({t, point});
  }
  return out;
}

/// Vertices on their way round the balls.
template <int Dim>
class PointObstacles<Dim>::Sliding {
 public:
  Sliding(const PointObstacles& obstacles, const Points<Dim>& from, const Elements<Dim>& T,
          const std::vector<Pair>& pairs)
      : obstacles_(obstacles), T_(T), pairs_(pairs), now_(from), is_pushed_(from.rows(), 0) {
    for (const Pair& pair : pairs)
      for (int i = 0; i < Dim; ++i) vertices_.push_back(T(pair.element, i));
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    for (const int vertex : vertices_)
      faces_.push_back(obstacles.box_ ? obstacles.box_->faces(from.row(vertex).transpose()) : 0);
  }

  void go(const Points<Dim>& to) {
    double longest = 0;
    for (const int vertex : vertices_)
      longest = std::max(longest, (to.row(vertex) - now_.row(vertex)).norm());
    const double radius = obstacles_.distance_mm_;
    const int n = std::max(1, int(std::ceil(longest / (kPart * radius))));
    Points<Dim> before;
    for (int part = 0; part < n; ++part) {
      before = now_;
      for (const int vertex : vertices_) {
        Vector<Dim> step = (to.row(vertex) - now_.row(vertex)).transpose() / (n - part);
        const double length = step.norm();
        if (length > kLongest * radius) step *= kLongest * radius / length;
        now_.row(vertex) += step.transpose();
      }
      push_out();
      for (bool is_any = true; is_any;) {
        is_any = false;
        for (const Pair& pair : pairs_)
          if (reaches_in(pair)) is_any |= set_back(pair.element, before);
      }
    }
  }

  /// Each element that reaches into a ball out of it, in turn.
  void push_out() {
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool is_any = false;
      for (const Pair& pair : pairs_) is_any |= push_out(pair);
      if (!is_any) return;
      if (!obstacles_.box_) continue;
      for (std::size_t k = 0; k < vertices_.size(); ++k)
        if (is_pushed_[vertices_[k]])
          now_.row(vertices_[k]) =
              obstacles_.box_->clamped(now_.row(vertices_[k]).transpose(), faces_[k]).transpose();
    }
  }

  /// What was pushed, or set back.
  bool hand_over(Points<Dim>& to) const {
    bool is_any = false;
    for (const int vertex : vertices_) {
      if (!is_pushed_[vertex]) continue;
      to.row(vertex) = now_.row(vertex);
      is_any = true;
    }
    return is_any;
  }

 private:
  Reach<Dim> reach(const Pair& pair) const {
    return {now_, T_, pair.element, obstacles_.points_[pair.point]};
  }
  bool reaches_in(const Pair& pair) const {
    return reach(pair).distance < (1 - kRounding) * obstacles_.distance_mm_;
  }

  bool push_out(const Pair& pair) {
    const Reach<Dim> at = reach(pair);
    const double radius = obstacles_.distance_mm_;
    if (at.distance >= (1 - kRounding) * radius || !(at.distance > 0)) return false;
    const double length = (kPushed * radius - at.distance) / at.weights.squaredNorm();
    for (int i = 0; i < Dim; ++i) {
      const int vertex = T_(pair.element, i);
      if (!(at.weights[i] > 0)) continue;
      now_.row(vertex) += length * at.weights[i] / at.distance * at.way.transpose();
      is_pushed_[vertex] = 1;
    }
    return true;
  }

  bool set_back(Eigen::Index t, const Points<Dim>& before) {
    bool is_any = false;
    for (int i = 0; i < Dim; ++i) {
      const int vertex = T_(t, i);
      if (now_.row(vertex) == before.row(vertex)) continue;
      now_.row(vertex) = before.row(vertex);
      is_pushed_[vertex] = 1;
      is_any = true;
    }
    return is_any;
  }

  const PointObstacles& obstacles_;
  const Elements<Dim>& T_;
  const std::vector<Pair>& pairs_;
  Points<Dim> now_;
  std::vector<char> is_pushed_;
  std::vector<int> vertices_;
  std::vector<std::uint8_t> faces_;  // of the vertices
};

template <int Dim>
void PointObstacles<Dim>::limit(const Points<Dim>& from, const Elements<Dim>& T,
                                Points<Dim>& to) const {
  const std::vector<Pair> pairs = pairs_near(from, to, T, 2 * distance_mm_);
  if (pairs.empty()) return;
  Sliding sliding(*this, from, T, pairs);
  sliding.go(to);
  sliding.hand_over(to);
}

template <int Dim>
Eigen::Index PointObstacles<Dim>::hold(const Points<Dim>& from, const Points<Dim>& limited,
                                       const Elements<Dim>& T, Points<Dim>& to) const {
  const std::vector<Pair> pairs = pairs_near(from, to, T, distance_mm_);
  const auto is_refused = [&](const Pair& pair) {
    const Vector<Dim>& point = points_[pair.point];
    if (Reach<Dim>(to, T, pair.element, point).distance < (1 - kRounding) * distance_mm_)
      return true;
    const auto a = corners_of<Dim>(from, T, pair.element), b = corners_of<Dim>(to, T, pair.element);
    if (b == corners_of<Dim>(limited, T, pair.element)) return false;
    const double longest = (b - a).rowwise().norm().maxCoeff();
    const int n = int(std::ceil(longest / (kPart * distance_mm_)));
    for (int part = 1; part < n; ++part) {
      const Eigen::Matrix<double, Dim, Dim> between =
          (a + double(part) / n * (b - a)).rowwise() - point.transpose();
      if ((between.transpose() * nearest_weights(between)).norm() < kPart * distance_mm_)
        return true;
    }
    return false;
  };
  Eigen::Index n_held = 0;
  for (bool is_any = true; is_any;) {
    is_any = false;
    for (const Pair& pair : pairs) {
      if (corners_of<Dim>(to, T, pair.element) == corners_of<Dim>(from, T, pair.element)) continue;
      if (!is_refused(pair)) continue;
      for (int i = 0; i < Dim; ++i) {
        const int vertex = T(pair.element, i);
        n_held += to.row(vertex) != from.row(vertex);
        to.row(vertex) = from.row(vertex);
      }
      is_any = true;
    }
  }
  return n_held;
}

template <int Dim>
bool PointObstacles<Dim>::push_away(const Elements<Dim>& T, Points<Dim>& X) const {
  const std::vector<Pair> pairs = pairs_near(X, X, T, 2 * distance_mm_);
  if (pairs.empty()) return false;
  Sliding sliding(*this, X, T, pairs);
  sliding.push_out();
  return sliding.hand_over(X);
}

template <int Dim>
std::vector<std::size_t> PointObstacles<Dim>::violated(const Elements<Dim>& T,
                                                       const Points<Dim>& X) const {
  std::vector<std::size_t> out;
  for (const Pair& pair : pairs_near(X, X, T, distance_mm_))
    if (Reach<Dim>(X, T, pair.element, points_[pair.point]).distance <
        (1 - kRounding) * distance_mm_)
      out.push_back(std::size_t(pair.point));
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

template <int Dim>
NearestPlace<Dim> nearest_place(const Simplices<Dim>& shape, const Vector<Dim>& point,
                                const std::optional<ImageBox<Dim>>& box) {
  NearestPlace<Dim> out;
  out.distance_mm = std::numeric_limits<double>::infinity();
  for (Eigen::Index t = 0; t < shape.elements.rows(); ++t) {
    const Reach<Dim> reach(shape.points, shape.elements, t, point);
    if (reach.distance >= out.distance_mm) continue;
    std::uint8_t faces = box ? 0xff : 0;
    for (int i = 0; box && i < Dim; ++i)
      faces &= box->faces(shape.points.row(shape.elements(t, i)).transpose());
    if (faces != 0) continue;
    out = {t, point + reach.way, reach.distance};
  }
  return out;
}

template <int Dim>
std::vector<char> are_held(const Simplices<Dim>& shape, const std::vector<HeldPoint<Dim>>& held,
                           double distance_mm, const std::optional<ImageBox<Dim>>& box) {
  if (held.empty()) return {};
  std::vector<Vector<Dim>> points;
  Points<Dim> rows(Eigen::Index(held.size()), Dim);
  for (const HeldPoint<Dim>& one : held) {
    rows.row(Eigen::Index(points.size())) = one.point;
    points.push_back(one.point);
  }
  std::vector<char> out = are_inside<Dim>(shape, rows);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = bool(out[k]) == held[k].is_inside;
  const PointObstacles<Dim> all(std::move(points), distance_mm, box);
  for (const std::size_t k : all.violated(shape.elements, shape.points)) out[k] = 0;
  return out;
}

template std::vector<char> are_held<2>(const Segments&, const std::vector<HeldPoint<2>>&, double,
                                       const std::optional<ImageBox<2>>&);
template std::vector<char> are_held<3>(const Triangles&, const std::vector<HeldPoint<3>>&, double,
                                       const std::optional<ImageBox<3>>&);
template class PointObstacles<2>;
template class PointObstacles<3>;
template NearestPlace<2> nearest_place<2>(const Segments&, const Vector<2>&,
                                          const std::optional<ImageBox<2>>&);
template NearestPlace<3> nearest_place<3>(const Triangles&, const Vector<3>&,
                                          const std::optional<ImageBox<3>>&);

}  // namespace surf::mesh
