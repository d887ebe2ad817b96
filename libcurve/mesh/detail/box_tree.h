// A tree of boxes over elements, shared between sources of this library.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// Elements one after the other along the curves: successors by their nodes, whatever the order of
/// the rows; curves by their place.
std::vector<int> order_along_curves(const Points<2>& points, const Elements<2>& elements);

struct Box {
  double x0, y0, x1, y1;
  void extend(const Box& b) {
    x0 = std::min(x0, b.x0);
    y0 = std::min(y0, b.y0);
    x1 = std::max(x1, b.x1);
    y1 = std::max(y1, b.y1);
  }
  double squared_distance(const Vector<2>& p) const {
    const double dx = std::max({x0 - p[0], p[0] - x1, 0.0}),
                 dy = std::max({y0 - p[1], p[1] - y1, 0.0});
    return dx * dx + dy * dy;
  }
  bool meets(const Box& b) const { return x0 <= b.x1 && b.x0 <= x1 && y0 <= b.y1 && b.y0 <= y1; }
};

/// A complete binary tree of boxes over runs of kLeaf elements along the curves. Runs hang
/// together, so boxes are tight without sorting; 1e6 elements are indexed in some 20 ms.
class BoxTree {
 public:
  /// @param margin  by which boxes are larger towards lower coordinates
  BoxTree(const Points<2>& points, const Elements<2>& elements, double margin)
      : order_(order_along_curves(points, elements)) {
    const int n = static_cast<int>(order_.size());
    n_leaves_ = (n + kLeaf - 1) / kLeaf;
    n_slots_ = 1;
    while (n_slots_ < n_leaves_) n_slots_ *= 2;
    boxes_.resize(n);
    for (int k = 0; k < n; ++k) {
      const double* a = points.data() + 2 * Eigen::Index(elements(order_[k], 0));
      const double* b = points.data() + 2 * Eigen::Index(elements(order_[k], 1));
      boxes_[k] = {std::min(a[0], b[0]) - margin, std::min(a[1], b[1]) - margin,
                   std::max(a[0], b[0]), std::max(a[1], b[1])};
    }
    constexpr double kInf = std::numeric_limits<double>::infinity();
    tree_.assign(2 * n_slots_, Box{kInf, kInf, -kInf, -kInf});
    for (int k = 0; k < n; ++k) tree_[n_slots_ + k / kLeaf].extend(boxes_[k]);
    for (int node = n_slots_ - 1; node > 0; --node) {
      tree_[node] = tree_[2 * node];
      tree_[node].extend(tree_[2 * node + 1]);
    }
  }

  /// Calls visit(e, f) for each pair of elements whose boxes meet, in no particular order.
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    if (n_leaves_ > 0) within(1, visit);
  }

  /// Calls visit(e) for elements, near ones first, but not for those whose box is at
  /// bound or further away from the point; visit returns the new bound [squared].
  template <class Visit>
  void for_each_near(const Vector<2>& point, double bound, const Visit& visit) const {
    if (n_leaves_ > 0) near(1, point, bound, visit);
  }

 private:
  static constexpr int kLeaf = 4;

  template <class Visit>
  void near(int node, const Vector<2>& point, double& bound, const Visit& visit) const {
    if (node >= n_slots_) {
      const auto [begin, end] = run(node);
      for (int k = begin; k < end; ++k)
        if (boxes_[k].squared_distance(point) < bound) bound = visit(order_[k]);
      return;
    }
    const double left = tree_[2 * node].squared_distance(point),
                 right = tree_[2 * node + 1].squared_distance(point);
    const int first = left <= right ? 2 * node : 2 * node + 1;
    if (std::min(left, right) < bound) near(first, point, bound, visit);
    if (std::max(left, right) < bound) near(first ^ 1, point, bound, visit);
  }

  template <class Visit>
  void within(int node, const Visit& visit) const {
    if (node >= n_slots_) {
      const auto [begin, end] = run(node);
      for (int k = begin; k < end; ++k)
        for (int l = k + 1; l < end; ++l)
          if (boxes_[k].meets(boxes_[l])) visit(order_[k], order_[l]);
      return;
    }
    if (!(tree_[node].x0 <= tree_[node].x1)) return;
    within(2 * node, visit);
    within(2 * node + 1, visit);
    between(2 * node, 2 * node + 1, visit);
  }

  /// Both nodes are on one level.
  template <class Visit>
  void between(int left, int right, const Visit& visit) const {
    if (!tree_[left].meets(tree_[right])) return;
    if (left >= n_slots_) {
      const auto [begin, end] = run(left);
      const auto [other_begin, other_end] = run(right);
      for (int k = begin; k < end; ++k) {
        if (!boxes_[k].meets(tree_[right])) continue;
        for (int l = other_begin; l < other_end; ++l)
          if (boxes_[k].meets(boxes_[l])) visit(order_[k], order_[l]);
      }
      return;
    }
    for (const int a : {2 * left, 2 * left + 1})
      for (const int b : {2 * right, 2 * right + 1}) between(a, b, visit);
  }

  std::pair<int, int> run(int node) const {
    const int begin = std::min<int>((node - n_slots_) * kLeaf, int(boxes_.size()));
    return {begin, std::min<int>(begin + kLeaf, int(boxes_.size()))};
  }

  std::vector<int> order_;
  int n_leaves_ = 0, n_slots_ = 1;
  std::vector<Box> boxes_, tree_;  // of elements in order; of nodes, the root is 1
};

}  // namespace surf::curve
