// Clicks in an image or a volume, no options: regions of a grid that may be the object, best first.
// They say which object is meant and where it leaks; where its boundary is, a curve or surface
// finds from there. See docs/method.md for why.
#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/rung_features.h"
#include "libsurf/segment/search_grid.h"

namespace surf::segment {

struct SearchOptions {
  /// Neck radii r [nodes]: what hangs on by a neck that is thinner is cut off.
  std::vector<double> neck_radii = {1, 1.5, 2, 3, 4, 6};
  /// See SearchLattice.
  double max_nodes = 3e6;
  /// Regions to return. They differ: no two have more than kMostOverlap in common.
  int max_regions = 4;
  static constexpr double kMostOverlap = 0.8;  // Dice
};

/// A region: how much of each node of a box belongs to it, between 0 and 1.
template <int Dim>
struct Region {
  std::array<int, Dim> size;
  Eigen::Transform<double, Dim, Eigen::Affine> node_to_world;
  std::vector<float> share;  ///< 1 inside, 0 outside, blurred by one node; 0.5 is the boundary
  double mean, half_width;   ///< of the window [intensity]; the mean of the first seed
  double neck_radius_mm;     ///< of the opening
  double node_mm;
  double score;  ///< larger is better; to compare regions of one search
  RungFeatures features;
};

/// Called on the caller's own thread now and then with the number of windows done; false stops.
using SearchProgress = std::function<bool(int n_done)>;

/// Wider and wider windows |I - mean| <= a = deviation 2^(q/2), q = 2, 3, ..., on an isotropic
/// grid; with several seeds the mean is that of one of them, whichever is nearest. Of each the
/// component M of the seeds, and of that for each r the opening: the part of {x in M: distance to
/// the outside > r} that holds the seeds or is within 8 nodes of them, and what lies within r of it
/// in M, its holes filled. Each (a, r) is scored by what its boundary looks like, and by its growth
/// from the window before and to the next.
///
/// O(windows (1 + neck radii) nodes in the component's box); one thread per window.
///
/// @param seeds  world mm, in the image
/// @param stop   when it is requested, what has been found is judged
/// @return  best score first; empty if no region reaches the size of a ball of 3 nodes
template <int Dim>
std::vector<Region<Dim>> search_regions(const SearchGrid<Dim>& grid,
                                        std::span<const Vector<Dim>> seeds,
                                        const SearchOptions& options = {},
                                        const SearchProgress& progress = {},
                                        const std::stop_token& stop = {});

}  // namespace surf::segment
