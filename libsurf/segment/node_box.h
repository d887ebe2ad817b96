// Morphology on boxes of nodes of a grid, in the plane and in space: components, holes, blur.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surf::segment {

using Flags = std::vector<std::uint8_t>;

/// A box of nodes lower <= index < lower + size; its own nodes count from 0, first index fastest.
template <int Dim>
struct NodeBox {
  using Index = std::array<int, Dim>;
  Index lower{}, size{};

  std::size_t n() const {
    std::size_t out = 1;
    for (const int along : size) out *= std::size_t(along);
    return out;
  }
  std::size_t at(const Index& node) const {
    std::size_t out = 0;
    for (int axis = Dim - 1; axis >= 0; --axis)
      out = out * size[axis] + std::size_t(node[axis] - lower[axis]);
    return out;
  }
  bool contains(const Index& node) const {
    for (int axis = 0; axis < Dim; ++axis)
      if (node[axis] < lower[axis] || node[axis] >= lower[axis] + size[axis]) return false;
    return true;
  }
  Index node(std::size_t at) const {
    Index out;
    for (int axis = 0; axis < Dim; ++axis) {
      out[axis] = lower[axis] + int(at % size[axis]);
      at /= size[axis];
    }
    return out;
  }

  /// Calls visit(at, here, stride) for every node, along each line of one axis in turn: `here`
  /// counts from 0 along the axis, the next node of the line is `stride` on.
  template <class Visit>
  void for_lines(int axis, const Visit& visit) const {
    std::size_t stride = 1;
    for (int a = 0; a < axis; ++a) stride *= size[a];
    std::size_t at = 0;
    for (const std::size_t end = n(); at < end;)
      for (int here = 0; here < size[axis]; ++here)
        for (std::size_t i = 0; i < stride; ++i, ++at) visit(at, here, stride);
  }
};

/// Whether all nodes are near the border along an axis, so that this says nothing.
template <int Dim>
bool has_few_slices(const NodeBox<Dim>& grid, int axis) {
  return grid.size[axis] < 16;
}

/// The box of the flagged nodes with a margin, within `box`; of size 0 if there is none.
template <int Dim>
NodeBox<Dim> bounds(const NodeBox<Dim>& box, const Flags& flags, int margin);

/// The values at the nodes of a part of the box.
template <int Dim, class T>
std::vector<T> cropped(const NodeBox<Dim>& box, const std::vector<T>& values,
                       const NodeBox<Dim>& part);

/// The flagged nodes that are connected, along the axes, with one of the starts, which are flagged.
template <int Dim>
Flags component(const NodeBox<Dim>& box, const Flags& flags, std::vector<std::size_t> starts);

/// Squared Euclidean distances [nodes^2] to the nearest flagged node where they are at most
/// reach^2, exactly; elsewhere something larger. O(reach nodes), the inner loops over rows.
/// @param reach  [nodes], at most 100
template <int Dim>
std::vector<std::int16_t> squared_distances(const NodeBox<Dim>& box, const Flags& flags, int reach);

/// The same exactly at any distance; infinity if no node is flagged. O(nodes).
template <int Dim>
std::vector<float> exact_squared_distances(const NodeBox<Dim>& box, const Flags& flags);

/// Flags what the flagged nodes enclose too: all that has no way to the border of the box.
template <int Dim>
void fill_holes(const NodeBox<Dim>& box, Flags& flags);

/// Closed by a node: grown along the axes, and shrunk again.
template <int Dim>
Flags closed(const NodeBox<Dim>& box, const Flags& flags);

/// Blurred along each axis by a binomial filter of deviation 1; beyond the box as at its border.
template <int Dim>
void blur(const NodeBox<Dim>& box, std::vector<float>& values);

}  // namespace surf::segment
