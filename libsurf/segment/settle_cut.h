// A region of a grid settles on the edges near its boundary: a least cut in a narrow band.
#pragma once

#include <vector>

#include "libsurf/segment/node_box.h"

namespace surf::segment {

/// Lengths in nodes. The weights lie in the middle of those that find most (docs/method.md).
struct SettleOptions {
  int width = 3;      ///< the boundary moves by less
  int shell = 4;      ///< outside, what the outer mean is taken of
  double reach = 4;   ///< deviation of the Gaussian of the means
  double pair = 4;    ///< of two neighbours that are alike, on both sides of the cut
  double hold = 0.5;  ///< per node that the boundary moves
  double clip = 2;    ///< of what the intensity of a node says
};

/// What a node of the box is held to.
enum class Held : std::uint8_t { kFree, kInside, kOutside };

/// The least sum over the band (nodes within `width` of the boundary) of
///
///   clip(2 ((I - m_out)^2 - (I - m_in)^2) / max(|m_in - m_out|, 2 noise)^2) + hold * depth
///
/// for nodes that are outside in place of inside, and of pair * exp(-(dI / e)^2 / 2) + 0.02 for
/// neighbours along the axes that the boundary parts, e the larger of 2 noise and half the median
/// of |dI| across the boundary given. m_in, m_out: means near by of what lies deeper than a node
/// inside, and of a shell outside. The means, not deviations too: with these it finds less.
///
/// Boykov-Kolmogorov with whole numbers; of equal cuts that of the least inside, so the result
/// does not depend on the order of the nodes.
///
/// @param inside     leaves a margin of width + 2 where the grid has one
/// @param intensity  at the nodes of the box
/// @param held       at each node, or empty; nodes off the band stay what they are
/// @param noise      [intensity]
/// @param costs      of each node outside in place of inside, besides; empty: none
/// @return  flags; may fall apart
template <int Dim>
Flags settled(const NodeBox<Dim>& box, const Flags& inside, const std::vector<float>& intensity,
              const std::vector<Held>& held, double noise, const std::vector<float>& costs = {},
              const SettleOptions& options = {});

}  // namespace surf::segment
