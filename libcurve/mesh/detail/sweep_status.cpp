#include "libcurve/mesh/detail/sweep_status.h"

namespace surf::curve {

int& SweepStatus::child_link(int node) {
  const int parent = nodes_[node].parent;
  if (parent < 0) return root_;
  return nodes_[parent].left == node ? nodes_[parent].left : nodes_[parent].right;
}

/// The node takes the place of its parent, which becomes its child.
void SweepStatus::rotate_up(int node) {
  const int parent = nodes_[node].parent;
  child_link(parent) = node;
  nodes_[node].parent = nodes_[parent].parent;
  nodes_[parent].parent = node;
  const bool is_left = nodes_[parent].left == node;
  int& inner = is_left ? nodes_[node].right : nodes_[node].left;
  (is_left ? nodes_[parent].left : nodes_[parent].right) = inner;
  if (inner >= 0) nodes_[inner].parent = parent;
  inner = parent;
}

int SweepStatus::insert_above(int place, int element) {
  int node = static_cast<int>(nodes_.size());
  if (free_.empty()) {
    nodes_.emplace_back();
    nodes_[node].priority = static_cast<std::uint32_t>(node * 0x9e3779b97f4a7c15ull >> 32);
  } else {
    node = free_.back();
    free_.pop_back();
  }
  Node& added = nodes_[node];
  added = {.element = element, .priority = added.priority};
  added.previous = place;
  added.next = above(place);
  (place < 0 ? first_ : nodes_[place].next) = node;
  if (added.next >= 0) nodes_[added.next].previous = node;
  if (root_ < 0) {
    root_ = node;
  } else if (place >= 0 && nodes_[place].right < 0) {
    nodes_[place].right = node;
    added.parent = place;
  } else {
    nodes_[added.next].left = node;
    added.parent = added.next;
  }
  while (added.parent >= 0 && nodes_[added.parent].priority < added.priority) rotate_up(node);
  return node;
}

void SweepStatus::erase(int place) {
  const Node& node = nodes_[place];
  while (node.left >= 0 || node.right >= 0) {
    const bool is_left = node.right < 0 || (node.left >= 0 && nodes_[node.left].priority >
                                                                  nodes_[node.right].priority);
    rotate_up(is_left ? node.left : node.right);
  }
  child_link(place) = -1;
  (node.previous < 0 ? first_ : nodes_[node.previous].next) = node.next;
  if (node.next >= 0) nodes_[node.next].previous = node.previous;
  free_.push_back(place);
}

}  // namespace surf::curve
