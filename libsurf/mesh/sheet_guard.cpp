#include "libsurf/mesh/sheet_guard.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "libsurf/mesh/detail/close_pairs.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

constexpr double kFacing = -0.2;  // cosine between the normals of sheets that face each other

Points<3> centroids(const Points<3>& X, const Elements<3>& T) {
  Points<3> out(T.rows(), 3);
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    out.row(t) = (X.row(T(t, 0)) + X.row(T(t, 1)) + X.row(T(t, 2))) / 3;
  return out;
}

Vector<3> area_normal(const Points<3>& X, const Elements<3>& T, Eigen::Index t) {
  const Vector<3> a = X.row(T(t, 1)) - X.row(T(t, 0)), b = X.row(T(t, 2)) - X.row(T(t, 0));
  return a.cross(b);
}

bool share_vertex(const Elements<3>& T, int a, int b) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (T(a, i) == T(b, j)) return true;
  return false;
}

}  // namespace

std::vector<std::pair<int, int>> triangles_in_contact(const Points<3>& from, const Points<3>& to,
                                                      const Elements<3>& elements,
                                                      double distance) {
  const Points<3> after = centroids(to, elements), before = centroids(from, elements);
  std::vector<std::pair<int, int>> pairs;
  const auto test = [&](int s, int t) {
    const double gap = (after.row(s) - after.row(t)).squaredNorm();
    if (gap >= distance * distance || gap >= (before.row(s) - before.row(t)).squaredNorm()) return;
    if (share_vertex(elements, s, t)) return;
    const Vector<3> n = area_normal(to, elements, s), m = area_normal(to, elements, t);
    if (n.dot(m) < kFacing * n.norm() * m.norm())
      pairs.emplace_back(std::min(s, t), std::max(s, t));
  };
  std::vector<BoundingBall> balls(elements.rows());
  for (std::size_t t = 0; t < balls.size(); ++t) balls[t] = {after.row(t), distance / 2};
  const RowGrid grid(balls, distance);
  for (int row = 0; row < grid.n_rows(); ++row) grid.for_each_pair(row, test);
  return pairs;
}

std::vector<char> vertices_in_contact(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& elements, double distance) {
  std::vector<char> touched(from.rows(), 0);
  for (const auto& [s, t] : triangles_in_contact(from, to, elements, distance))
    for (int i = 0; i < 3; ++i) touched[elements(s, i)] = touched[elements(t, i)] = 1;
  return touched;
}

namespace {

constexpr int kRoundsAlone = 4;    // before neighbours are held too
constexpr int kRoundsGrowing = 6;  // 1, 2, 4, .. rings of them, before all are

/// A step whose destination is made free of intersections.
class Holding {
 public:
  Holding(const Points<3>& from, Points<3>& to, const Elements<3>& T, HeldPairs pairs)
      : from_(from), to_(to), T_(T), pairs_(pairs), is_marked_(from.rows(), 0) {}

  Eigen::Index run() {
    std::vector<char> active(T_.rows());
    for (Eigen::Index t = 0; t < T_.rows(); ++t) active[t] = has_moved(t);
    Eigen::Index n_held = 0;
    for (int round = 0;; ++round) {
      std::fill(is_marked_.begin(), is_marked_.end(), 0);
      if (!mark(active)) return n_held;
      if (round >= kRoundsAlone + kRoundsGrowing)
        std::fill(is_marked_.begin(), is_marked_.end(), 1);
      for (int ring = round < kRoundsAlone ? 0 : 1 << (round - kRoundsAlone); ring > 0; --ring)
        mark_neighbours();
      n_held += hold_marked(active);
    }
  }

 private:
  bool is_moved(int vertex) const { return to_.row(vertex) != from_.row(vertex); }
  bool has_moved(Eigen::Index t) const {
    return is_moved(T_(t, 0)) || is_moved(T_(t, 1)) || is_moved(T_(t, 2));
  }

  /// Marks the corners of active triangles that may not stay; false if there are none.
  bool mark(const std::vector<char>& active) {
    bool is_any = false;
    const auto mark_corners = [&](Eigen::Index t) {
      for (int i = 0; i < 3; ++i) is_marked_[T_(t, i)] = 1;
      is_any = true;
    };
    for (Eigen::Index t = 0; t < T_.rows(); ++t)
      if (active[t] && has_turned(t)) mark_corners(t);
    if (pairs_ == HeldPairs::kNone) return is_any;
    for (const auto& [a, b] : self_intersections(to_, T_, active)) {
      if (!has_moved(a) && !has_moved(b)) continue;
      if (has_area(a) && has_area(b) && do_intersect(from_, T_, a, b)) continue;
      mark_corners(a);
      mark_corners(b);
    }
    return is_any;
  }

  /// Before the step; do_intersect() asks for it.
  bool has_area(Eigen::Index t) const { return area_normal(from_, T_, t) != Vector<3>::Zero(); }

  bool has_turned(Eigen::Index t) const {
    const Vector<3> before = area_normal(from_, T_, t);
    return !(before.dot(area_normal(to_, T_, t)) > 0) && has_moved(t) &&
           before != Vector<3>::Zero();
  }

  void mark_neighbours() {
    std::vector<char> wider = is_marked_;
    for (Eigen::Index t = 0; t < T_.rows(); ++t)
      if (is_marked_[T_(t, 0)] || is_marked_[T_(t, 1)] || is_marked_[T_(t, 2)])
        for (int i = 0; i < 3; ++i) wider[T_(t, i)] = 1;
    is_marked_ = std::move(wider);
  }

  /// Sets marked vertices back; active are the triangles this changes.
  Eigen::Index hold_marked(std::vector<char>& active) {
    Eigen::Index n_held = 0;
    for (int i = 0; i < from_.rows(); ++i) {
      is_marked_[i] = is_marked_[i] && is_moved(i);
      if (!is_marked_[i]) continue;
      to_.row(i) = from_.row(i);
      ++n_held;
    }
    for (Eigen::Index t = 0; t < T_.rows(); ++t)
      active[t] = is_marked_[T_(t, 0)] || is_marked_[T_(t, 1)] || is_marked_[T_(t, 2)];
    return n_held;
  }

  const Points<3>& from_;
  Points<3>& to_;
  const Elements<3>& T_;
  HeldPairs pairs_;
  std::vector<char> is_marked_;  // vertices
};

}  // namespace

Eigen::Index hold_intersecting(const Points<3>& from, Points<3>& to, const Elements<3>& elements,
                               HeldPairs pairs) {
  return Holding(from, to, elements, pairs).run();
}

Eigen::Index hold_slivers(const Points<3>& from, Points<3>& to, const Elements<3>& elements,
                          double least_angle_deg) {
  constexpr int kHalvings = 8;
  const double most = cos_deg(least_angle_deg);
  const auto sharpest = [&](const Points<3>& points, Eigen::Index e) {
    const auto corner = [&](int c) { return Eigen::Vector3d(points.row(elements(e, c))); };
    return angle_cosines(corner(0), corner(1), corner(2)).sharpest;
  };
  std::vector<char> was_held(std::size_t(to.rows()), 0);
  for (int round = 0;; ++round) {
    std::vector<char> is_thin(std::size_t(to.rows()), 0);
    bool any = false;
    for (Eigen::Index e = 0; e < elements.rows(); ++e) {
      const double after = sharpest(to, e);
      if (after <= most || after <= sharpest(from, e)) continue;
      for (const int vertex : elements.row(e))
        if (to.row(vertex) != from.row(vertex)) is_thin[vertex] = was_held[vertex] = any = true;
    }
    if (!any) break;
    for (std::size_t i = 0; i < is_thin.size(); ++i) {
      if (!is_thin[i]) continue;
      const auto at = Eigen::Index(i);
      if (round < kHalvings)
        to.row(at) = 0.5 * (to.row(at) + from.row(at));
      else
        to.row(at) = from.row(at);
    }
  }
  return std::count(was_held.begin(), was_held.end(), 1);
}

}  // namespace surf::mesh
