// Closed polygons as a linked list of elements (thesis 4.3.1).
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// Every node starts one element and ends one, so element i is the one that starts at node i: it
/// runs from node i to node next(i), and next and prev of a node are those of its element.
class CurveMesh {
 public:
  CurveMesh() = default;
  /// Nodes keep their numbers; points that no element uses are dropped.
  /// @throws InvalidMesh  a node does not start and end exactly one element, an element names a
  ///                      node outside the points, or a point is not finite
  explicit CurveMesh(const Segments& curves);

  int size() const { return static_cast<int>(points_.size()); }
  int next(int i) const { return next_[i]; }
  int prev(int i) const { return prev_[i]; }
  const Vector<2>& point(int i) const { return points_[i]; }
  void set_point(int i, const Vector<2>& to) { points_[i] = to; }
  double length(int i) const { return (points_[next_[i]] - points_[i]).norm(); }

  Points<2> points() const;
  void set_points(const Points<2>& to);
  /// Row i: i, next(i).
  Elements<2> elements() const;
  Segments segments() const { return {points(), elements()}; }

  /// Splits element i at this point; the new node, and element, is the last one: i -> new.
  int split(int i, const Vector<2>& at);
  /// Removes the flagged nodes by joining their neighbours. Components of which fewer than three
  /// nodes stay go. Nodes are numbered anew, in their order.
  /// @return  the old number of each node
  std::vector<int> remove(const std::vector<char>& is_gone);

  /// Component of each node, numbered in the order of their first nodes.
  std::vector<int> components() const;

 private:
  std::vector<Vector<2>> points_;
  std::vector<int> next_, prev_;
};

}  // namespace surf::curve
