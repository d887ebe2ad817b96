// Boxes of nodes of a grid, in the plane and in space: parts, distances, blur.
#pragma once

#include <algorithm>
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

/// The values at the nodes of a part of the box.
template <int Dim, class T>
std::vector<T> cropped(const NodeBox<Dim>& box, const std::vector<T>& values,
                       const NodeBox<Dim>& part) {
  std::vector<T> out(part.n());
  for (std::size_t at = 0; at < out.size(); at += part.size[0])
    std::copy_n(values.begin() + std::ptrdiff_t(box.at(part.node(at))), part.size[0],
                out.begin() + std::ptrdiff_t(at));
  return out;
}

inline constexpr int kLongestReach = 100;  ///< [nodes]: of which three squares are 16 bits

/// Squared Euclidean distances [nodes^2] to the nearest flagged node where they are at most
/// reach^2, exactly; elsewhere something larger. O(reach nodes), the inner loops over rows.
/// @param reach  [nodes], at most kLongestReach
template <int Dim>
std::vector<std::int16_t> squared_distances(const NodeBox<Dim>& box, const Flags& flags, int reach);

/// The same exactly at any distance; infinity if no node is flagged. O(nodes).
template <int Dim>
std::vector<float> exact_squared_distances(const NodeBox<Dim>& box, const Flags& flags);

/// Blurred along each axis by a binomial filter of deviation 1; beyond the box as at its border.
template <int Dim>
void blur(const NodeBox<Dim>& box, std::vector<float>& values);

}  // namespace surf::segment
