// Morphology on boxes of nodes of a grid, in the plane and in space: components, holes, blur.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libsurf/base/index_box.h"

namespace surf::segment {

using Flags = std::vector<std::uint8_t>;

/// Of nodes; its own count from 0.
template <int Dim>
using NodeBox = IndexBox<Dim>;

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
