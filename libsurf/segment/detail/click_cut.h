// All clicks of an object at once: a least cut between what is inside and what is outside.
#pragma once

#include "libsurf/segment/pieces.h"

namespace surf::segment {

/// Weights and lengths of the cut; a click paints a ball of 2 nodes, as a brush does.
struct ClickCutOptions {
  double brush = 2;  ///< radius [nodes]
  /// Of the object's extent, at least `least_margin` nodes: to the box whose faces are outside, but
  /// where the object reaches the border of the grid. With a box round the object it is that box.
  double margin = 0.15;
  int least_margin = 5;
  double intensity = 1;     ///< what the intensities say
  double nearness = 2;      ///< which clicks are nearer
  double length = 0.1;      ///< of a way of one node, in noises
  double most_nodes = 4e5;  ///< a larger box is looked at with steps of two nodes
};

template <int Dim>
struct ClickCuts {
  std::vector<NodeSet<Dim>> inside;  ///< one for each weight, at the nodes of the scene's box
  /// Of each node what it costs outside less what it costs inside, without the object; 0 beyond the
  /// box of the cut. Empty where all is of one intensity.
  std::vector<float> costs;
};

/// The part with the inside clicks of the nodes that a least cut (Boykov and Jolly 2001, with
/// geodesic distances as Price et al. 2010) leaves inside: the least sum over nodes of
///
///   intensity * (1 - P) + nearness * d_in / (d_in + d_out) + object * [not of the object]  inside
///   intensity * P + nearness * d_out / (d_in + d_out) + object * [of the object]           outside
///
/// and over neighbours along the axes that are parted of exp(-dI^2 / (2 mean dI^2)). P compares the
/// Gaussians of the inside clicks' balls with the histogram of outside clicks and faces; d are the
/// least sums of |dI| + length * noise along ways to the clicks of a side (for the outside: and the
/// faces). Intensities between their 0.5 and 99.5 percentiles count from 0 to 1.
///
/// @param object  weights of what the object was so far
template <int Dim>
ClickCuts<Dim> click_cuts(const ClickScene<Dim>& scene, std::span<const double> object,
                          const ClickCutOptions& options = {});

}  // namespace surf::segment
