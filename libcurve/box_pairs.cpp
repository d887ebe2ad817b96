#include <algorithm>
#include <limits>

#include "libcurve/exact_segments.h"
#include "libcurve/intersections.h"

namespace surf::curve {
namespace {

struct Box {
  double x0, y0, x1, y1;
  void extend(const Box& b) {
    x0 = std::min(x0, b.x0);
    y0 = std::min(y0, b.y0);
    x1 = std::max(x1, b.x1);
    y1 = std::max(y1, b.y1);
  }
  bool meets(const Box& b) const { return x0 <= b.x1 && b.x0 <= x1 && y0 <= b.y1 && b.y0 <= y1; }
};

/// Elements one after the other along the curves: successors by their nodes, whatever the order of
/// the rows. Where rows follow each other already that order is kept.
std::vector<int> order_along_curves(const Points<2>& points, const Elements<2>& elements) {
  const int n = static_cast<int>(elements.rows());
  std::vector<int> order(n);
  bool is_ordered = true;
  int n_breaks = 0;
  for (int e = 0; e < n; ++e) {
    order[e] = e;
    n_breaks += e > 0 && elements(e, 0) != elements(e - 1, 1);
  }
  is_ordered = n_breaks < n / 8;
  if (is_ordered) return order;
  std::vector<int> starting(points.rows(), -1);
  for (int e = n - 1; e >= 0; --e) starting[elements(e, 0)] = e;
  std::vector<char> is_placed(n, 0);
  order.clear();
  for (int first = 0; first < n; ++first)
    for (int e = first; e >= 0 && !is_placed[e]; e = starting[elements(e, 1)]) {
      is_placed[e] = 1;
      order.push_back(e);
    }
  return order;
}

/// A complete binary tree of boxes over runs of kLeaf elements along the curves. Runs hang
/// together, so boxes are tight without sorting; 1e6 elements are indexed in some 20 ms.
class BoxTree {
 public:
  BoxTree(const Points<2>& points, const Elements<2>& elements, double margin)
      : points_(points), elements_(elements), order_(order_along_curves(points, elements)) {
    const int n = static_cast<int>(order_.size());
    n_leaves_ = (n + kLeaf - 1) / kLeaf;
    n_slots_ = 1;
    while (n_slots_ < n_leaves_) n_slots_ *= 2;
    boxes_.resize(n);
    for (int k = 0; k < n; ++k) {
      const double* a = point(elements(order_[k], 0));
      const double* b = point(elements(order_[k], 1));
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

 private:
  static constexpr int kLeaf = 4;

  const double* point(int i) const { return points_.data() + 2 * Eigen::Index(i); }

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

  const Points<2>& points_;
  const Elements<2>& elements_;
  std::vector<int> order_;
  int n_leaves_ = 0, n_slots_ = 1;
  std::vector<Box> boxes_, tree_;  // of elements in order; of nodes, the root is 1
};

bool share_a_node(const Elements<2>& elements, int e, int f) {
  return elements(e, 0) == elements(f, 0) || elements(e, 0) == elements(f, 1) ||
         elements(e, 1) == elements(f, 0) || elements(e, 1) == elements(f, 1);
}

template <class Accept>
std::vector<ElementPair> sorted_pairs(const Points<2>& points, const Elements<2>& elements,
                                      double margin, const Accept& accept) {
  std::vector<ElementPair> out;
  BoxTree(points, elements, margin).for_each_pair([&](int e, int f) {
    if (accept(e, f)) out.emplace_back(std::min(e, f), std::max(e, f));
  });
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

std::vector<ElementPair> intersections_by_boxes(const Points<2>& points,
                                                const Elements<2>& elements,
                                                const std::vector<char>* flagged) {
  return sorted_pairs(points, elements, 0, [&](int e, int f) {
    return (!flagged || (*flagged)[e] || (*flagged)[f]) && do_meet(points, elements, e, f);
  });
}

std::vector<ElementPair> near_pairs(const Points<2>& points, const Elements<2>& elements,
                                    double distance) {
  check_elements(points, elements);
  return sorted_pairs(points, elements, distance,
                      [&](int e, int f) { return !share_a_node(elements, e, f); });
}

}  // namespace surf::curve
