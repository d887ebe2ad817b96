// Pairs of triangles that lie close together: what searches for contacts begin with.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Ball about a triangle: its centroid and the distance to its farthest corner.
struct BoundingBall {
  Eigen::Vector3d center;
  double radius;
};

/// Of each triangle. @pre  indices name points
std::vector<BoundingBall> bounding_balls(const Points<3>& points, const Elements<3>& elements);

/// Points in the rows of a grid over y and z, each row sorted by x: a sweep along the rows
/// finds all pairs closer than `reach`. Time and memory are linear where points lie about as dense
/// as on a surface whose triangles have the size of the reach.
class RowGrid {
 public:
  /// @pre  reach >= 0; 0 where all balls are points
  RowGrid(const std::vector<BoundingBall>& balls, double reach);

  int n_rows() const { return static_cast<int>(first_.size()) - 1; }

  /// Calls visit(a, b), numbers of balls, once for every pair whose balls meet (with room for
  /// rounding) and whose first one, in the order of the grid, is in this row.
  /// @pre  reach >= the sum of the two radii
  template <class Visit>
  void for_each_pair(int row, const Visit& visit) const;

 private:
  struct Entry {
    double x, y, z, radius;
    int number;
  };

  /// Of the pairs of an entry of the row and one of the other row; of the same row each once.
  template <class Visit>
  void sweep(int row, int other, const Visit& visit) const;

  static bool is_meeting(const Entry& a, const Entry& b) {
    const double dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z, r = a.radius + b.radius;
    constexpr double kRoom = 1 + 1e-9;
    return dx * dx + dy * dy + dz * dz <= kRoom * r * r;
  }

  double reach_;
  int n_y_ = 0, n_z_ = 0;
  std::vector<int> first_;  // of each row in entries_, and the end
  std::vector<Entry> entries_;
};

template <class Visit>
void RowGrid::for_each_pair(int row, const Visit& visit) const {
  const int y = row % n_y_, z = row / n_y_;
  sweep(row, row, visit);
  if (y + 1 < n_y_) sweep(row, row + 1, visit);
  if (z + 1 == n_z_) return;
  for (int other = std::max(y - 1, 0); other <= std::min(y + 1, n_y_ - 1); ++other)
    sweep(row, other + (z + 1) * n_y_, visit);
}

template <class Visit>
void RowGrid::sweep(int row, int other, const Visit& visit) const {
  int first = first_[other], last = first;
  std::vector<int> met(first_[other + 1] - first);
  for (int at = first_[row]; at < first_[row + 1]; ++at) {
    const Entry& entry = entries_[at];
    while (first < first_[other + 1] && entries_[first].x < entry.x - reach_) ++first;
    while (last < first_[other + 1] && entries_[last].x <= entry.x + reach_) ++last;
    // Without branches: about one in five is met, which no processor foresees.
    int n_met = 0;
    for (int next = row == other ? at + 1 : first; next < last; ++next) {
      met[n_met] = entries_[next].number;
      n_met += is_meeting(entry, entries_[next]);
    }
    for (int k = 0; k < n_met; ++k) visit(entry.number, met[k]);
  }
}

}  // namespace surf::mesh
