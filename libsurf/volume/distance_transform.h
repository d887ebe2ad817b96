// Distances on a grid to the nearest node of a set.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace surf::volume {

/// Squared Euclidean distance [nodes^2] from each node of a grid to the nearest one of a set, by
/// lower envelopes of parabolas along one axis after the other (Felzenszwalb and Huttenlocher,
/// Theory of Computing 8, 2012). Exact for lines of up to
/// 4096 nodes; O(nodes). kInfiniteDistance everywhere if the set is empty.
/// @param size  nodes along the axes, the first one fastest
/// @param set   a flag for each node
template <std::size_t Dim>
std::vector<float> squared_distances(const std::array<int, Dim>& size,
                                     const std::vector<std::uint8_t>& set);

inline constexpr float kInfiniteDistance = 1e18f;

}  // namespace surf::volume
