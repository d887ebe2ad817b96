#include "libsurf/mesh/sheet_guard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "libsurf/mesh/self_intersections.h"

namespace surf::mesh {
namespace {

constexpr double kFacing = -0.2;  // cosine between the normals of sheets that face each other

Points<3> centroids(const Points<3>& X, const Elements<3>& T) {
  Points<3> out(T.rows(), 3);
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    out.row(t) = (X.row(T(t, 0)) + X.row(T(t, 1)) + X.row(T(t, 2))) / 3;
  return out;
}

Points<3> unit_normals(const Points<3>& X, const Elements<3>& T) {
  Points<3> out(T.rows(), 3);
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Vector<3> a = X.row(T(t, 1)) - X.row(T(t, 0)), b = X.row(T(t, 2)) - X.row(T(t, 0));
    out.row(t) = a.cross(b).normalized();
  }
  return out;
}

bool share_vertex(const Elements<3>& T, int a, int b) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (T(a, i) == T(b, j)) return true;
  return false;
}

/// Points sorted by the cell of a grid they lie in.
class CellOrder {
 public:
  CellOrder(const Points<3>& points, double cell) : order_(points.rows()), keys_(points.rows()) {
    std::vector<std::uint64_t> keys(points.rows());
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      keys[i] = key(std::int64_t(std::floor(points(i, 0) / cell)),
                    std::int64_t(std::floor(points(i, 1) / cell)),
                    std::int64_t(std::floor(points(i, 2) / cell)));
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(),
              [&](int a, int b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
    for (std::size_t at = 0; at < order_.size(); ++at) keys_[at] = keys[order_[at]];
  }

  /// Point at this place of the order.
  int point(std::size_t at) const { return order_[at]; }
  std::size_t size() const { return order_.size(); }

  /// Calls visit(a, b), places in the order, for every pair of points in the same or in
  /// neighbouring cells once. Keys grow along the order, so each row of three cells is found
  /// by a cursor that only moves forward.
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    // Rows (dy, dz) after the point's own one; its own row holds pairs a < b only.
    constexpr std::array<std::array<std::int64_t, 2>, 4> kRows = {
        {{1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
    std::array<std::size_t, 4> cursor{};
    for (std::size_t a = 0; a < size(); ++a) {
      for (std::size_t b = a + 1; b < size() && keys_[b] <= keys_[a] + 1; ++b) visit(a, b);
      for (std::size_t row = 0; row < kRows.size(); ++row) {
        const std::uint64_t first = keys_[a] + key_step(kRows[row][0], kRows[row][1]) - 1;
        std::size_t& at = cursor[row];
        while (at < size() && keys_[at] < first) ++at;
        for (std::size_t b = at; b < size() && keys_[b] <= first + 2; ++b) visit(a, b);
      }
    }
  }

 private:
  /// 21 bits per axis: unique for coordinates within a million cells of the origin.
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kOffset = 1 << 20;
    return (std::uint64_t(z + kOffset) << 42) | (std::uint64_t(y + kOffset) << 21) |
           std::uint64_t(x + kOffset);
  }
  static std::uint64_t key_step(std::int64_t dy, std::int64_t dz) {
    return std::uint64_t(dz * (std::int64_t(1) << 42) + dy * (std::int64_t(1) << 21));
  }

  std::vector<int> order_;
  std::vector<std::uint64_t> keys_;
};

template <class Rows>
Points<3> reordered(const Rows& rows, const CellOrder& order) {
  Points<3> out(rows.rows(), 3);
  for (std::size_t at = 0; at < order.size(); ++at) out.row(at) = rows.row(order.point(at));
  return out;
}

}  // namespace

std::vector<char> vertices_in_contact(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& elements, double distance) {
  const Points<3> all_after = centroids(to, elements);
  const CellOrder order(all_after, distance);
  const Points<3> after = reordered(all_after, order);  // neighbours lie close in memory
  const Points<3> before = reordered(centroids(from, elements), order);
  const Points<3> normals = reordered(unit_normals(to, elements), order);
  std::vector<char> touched(from.rows(), 0);
  const double limit = distance * distance;
  order.for_each_pair([&](std::size_t a, std::size_t b) {
    const double gap = (after.row(a) - after.row(b)).squaredNorm();
    if (gap >= limit || normals.row(a).dot(normals.row(b)) > kFacing) return;
    if (gap >= (before.row(a) - before.row(b)).squaredNorm()) return;
    const int s = order.point(a), t = order.point(b);
    if (share_vertex(elements, s, t)) return;
    for (int i = 0; i < 3; ++i) touched[elements(s, i)] = touched[elements(t, i)] = 1;
  });
  return touched;
}

namespace {

constexpr int kRoundsAlone = 4;    // before neighbours are held too
constexpr int kRoundsGrowing = 6;  // 1, 2, 4, .. rings of them, before all are

Vector<3> area_normal(const Points<3>& X, const Elements<3>& T, Eigen::Index t) {
  const Vector<3> a = X.row(T(t, 1)) - X.row(T(t, 0)), b = X.row(T(t, 2)) - X.row(T(t, 0));
  return a.cross(b);
}

/// A step whose destination is made free of intersections.
class Holding {
 public:
  Holding(const Points<3>& from, Points<3>& to, const Elements<3>& T)
      : from_(from), to_(to), T_(T), is_marked_(from.rows(), 0) {}

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
    for (const auto& [a, b] : self_intersections(to_, T_, active)) {
      if (!has_moved(a) && !has_moved(b)) continue;
      if (do_intersect(from_, T_, a, b)) continue;
      mark_corners(a);
      mark_corners(b);
    }
    return is_any;
  }

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
  std::vector<char> is_marked_;  // vertices
};

}  // namespace

Eigen::Index hold_intersecting(const Points<3>& from, Points<3>& to, const Elements<3>& elements) {
  return Holding(from, to, elements).run();
}

}  // namespace surf::mesh
