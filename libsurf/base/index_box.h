// Boxes of nodes, voxels or cells of a grid.
#pragma once

#include <array>
#include <cstddef>

namespace surf {

/// lower <= index < lower + size; what is in it counts from 0, first index fastest.
template <int Dim>
struct IndexBox {
  using Index = std::array<int, Dim>;
  Index lower{}, size{};

  static IndexBox between(const Index& lower, const Index& upper) {
    IndexBox out{lower, upper};
    for (int axis = 0; axis < Dim; ++axis) out.size[axis] -= lower[axis];
    return out;
  }
  /// The same along every axis.
  static IndexBox cube(int lower, int size) {
    IndexBox out;
    out.lower.fill(lower);
    out.size.fill(size);
    return out;
  }
  Index upper() const {
    Index out = lower;
    for (int axis = 0; axis < Dim; ++axis) out[axis] += size[axis];
    return out;
  }
  std::size_t n() const { return stride(Dim); }
  /// From one number to that of the next index along the axis.
  std::size_t stride(int axis) const {
    std::size_t out = 1;
    for (int before = 0; before < axis; ++before) out *= std::size_t(size[before]);
    return out;
  }
  std::size_t at(const Index& node) const {
    std::size_t out = 0;
    for (int axis = Dim - 1; axis >= 0; --axis)
      out = out * size[axis] + std::size_t(node[axis] - lower[axis]);
    return out;
  }
  Index node(std::size_t at) const {
    Index out;
    for (int axis = 0; axis < Dim; ++axis) {
      out[axis] = lower[axis] + int(at % size[axis]);
      at /= size[axis];
    }
    return out;
  }
  bool contains(const Index& node) const {
    for (int axis = 0; axis < Dim; ++axis)
      if (node[axis] < lower[axis] || node[axis] >= lower[axis] + size[axis]) return false;
    return true;
  }
  /// Calls visit(neighbour) for those along the axes; returns how many the box cuts off.
  template <class Visit>
  int for_neighbours(std::size_t at, const Visit& visit) const {
    const Index here = node(at);
    int n_missing = 0;
    std::size_t step = 1;
    for (int axis = 0; axis < Dim; step *= size[axis], ++axis) {
      here[axis] > lower[axis] ? visit(at - step) : void(++n_missing);
      here[axis] + 1 < lower[axis] + size[axis] ? visit(at + step) : void(++n_missing);
    }
    return n_missing;
  }
  /// Calls visit(at, here, stride) for every node, along each line of one axis in turn: `here`
  /// counts from 0 along the axis, the next node of the line is `stride` on.
  template <class Visit>
  void for_lines(int axis, const Visit& visit) const {
    const std::size_t step = stride(axis);
    std::size_t at = 0;
    for (const std::size_t end = n(); at < end;)
      for (int here = 0; here < size[axis]; ++here)
        for (std::size_t i = 0; i < step; ++i, ++at) visit(at, here, step);
  }
};

}  // namespace surf
