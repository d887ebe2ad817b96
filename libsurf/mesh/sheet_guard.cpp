#include "libsurf/mesh/sheet_guard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

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
class HashGrid {
 public:
  HashGrid(const Points<3>& points, double cell) : cell_(cell), order_(points.rows()) {
    keys_.resize(points.rows());
    for (Eigen::Index i = 0; i < points.rows(); ++i) keys_[i] = key(index(points.row(i)));
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(),
              [&](int a, int b) { return keys_[a] != keys_[b] ? keys_[a] < keys_[b] : a < b; });
    std::vector<std::uint64_t> sorted(keys_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) sorted[i] = keys_[order_[i]];
    keys_ = std::move(sorted);
  }

  /// Calls visit(j) for every point j in the 27 cells round x.
  template <class Visit>
  void for_each_near(const Vector<3>& x, const Visit& visit) const {
    const auto centre = index(x);
    for (int c = -1; c <= 1; ++c)
      for (int b = -1; b <= 1; ++b) {
        // Three cells in a row along the first axis have consecutive keys.
        const std::uint64_t first = key({centre[0] - 1, centre[1] + b, centre[2] + c});
        auto at = std::lower_bound(keys_.begin(), keys_.end(), first) - keys_.begin();
        for (; at < std::ptrdiff_t(keys_.size()) && keys_[at] <= first + 2; ++at) visit(order_[at]);
      }
  }

 private:
  std::array<std::int64_t, 3> index(const Vector<3>& x) const {
    return {std::int64_t(std::floor(x[0] / cell_)), std::int64_t(std::floor(x[1] / cell_)),
            std::int64_t(std::floor(x[2] / cell_))};
  }
  /// 21 bits per axis: unique for coordinates within a million cells of the origin.
  static std::uint64_t key(const std::array<std::int64_t, 3>& i) {
    constexpr std::int64_t kOffset = 1 << 20;
    return (std::uint64_t(i[2] + kOffset) << 42) | (std::uint64_t(i[1] + kOffset) << 21) |
           std::uint64_t(i[0] + kOffset);
  }

  double cell_;
  std::vector<int> order_;
  std::vector<std::uint64_t> keys_;
};

}  // namespace

std::vector<char> vertices_in_contact(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& elements, double distance) {
  const Points<3> before = centroids(from, elements), after = centroids(to, elements);
  const Points<3> normals = unit_normals(to, elements);
  const HashGrid grid(after, distance);
  std::vector<char> touched(from.rows(), 0);
  const double limit = distance * distance;
  for (int a = 0; a < elements.rows(); ++a)
    grid.for_each_near(after.row(a), [&](int b) {
      if (b <= a || normals.row(a).dot(normals.row(b)) > kFacing) return;
      const double gap = (after.row(a) - after.row(b)).squaredNorm();
      if (gap >= limit || gap >= (before.row(a) - before.row(b)).squaredNorm()) return;
      if (share_vertex(elements, a, b)) return;
      for (int i = 0; i < 3; ++i) touched[elements(a, i)] = touched[elements(b, i)] = 1;
    });
  return touched;
}

}  // namespace surf::mesh
