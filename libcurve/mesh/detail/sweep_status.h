// The elements that a sweep line meets, from bottom to top.
#pragma once

#include <cstdint>
#include <vector>

namespace surf::curve {

/// A sequence that is kept in a balanced tree (a treap with a fixed sequence of priorities): places
/// are inserted, erased and searched for in O(log n), neighbours are found in O(1). Which element
/// is at a place may be changed at will. -1 is no place.
class SweepStatus {
 public:
  int above(int place) const { return place < 0 ? first_ : nodes_[place].next; }
  int below(int place) const { return nodes_[place].previous; }
  int element(int place) const { return nodes_[place].element; }
  void set_element(int place, int element) { nodes_[place].element = element; }

  /// The last place of a sequence for whose elements is_below holds from the first to some place,
  /// else -1.
  template <class IsBelow>
  int last_below(const IsBelow& is_below) const {
    int found = -1;
    for (int at = root_; at >= 0;) {
      const bool goes_up = is_below(nodes_[at].element);
      if (goes_up) found = at;
      at = goes_up ? nodes_[at].right : nodes_[at].left;
    }
    return found;
  }
  /// A new place just above this one; -1: below all.
  int insert_above(int place, int element);
  void erase(int place);

 private:
  struct Node {
    int element;
    int left = -1, right = -1, parent = -1;
    int previous = -1, next = -1;
    std::uint32_t priority;
  };

  int& child_link(int node);
  void rotate_up(int node);

  std::vector<Node> nodes_;
  std::vector<int> free_;
  int root_ = -1, first_ = -1;
};

}  // namespace surf::curve
