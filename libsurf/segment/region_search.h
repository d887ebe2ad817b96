// Clicks in an image or a volume, no options: regions of a grid that may be the object, best first.
// They say which object is meant and where it leaks; where its boundary is, a curve or surface
// finds from there. See docs/method.md for why.
#pragma once

#include <functional>
#include <numbers>
#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/ladder.h"

namespace surf::segment {

struct SearchOptions {
  /// Neck radii r [nodes]: what hangs on by a neck that is thinner is cut off.
  std::vector<double> neck_radii = {1, 1.5, 2, 3, 4, 6};
  /// See SearchLattice.
  double max_nodes = 1.5e6;
  /// Regions to return. They differ: no two have more than kMostOverlap in common.
  int max_regions = 4;
  static constexpr double kMostOverlap = 0.8;  // Dice
  static constexpr double kMostOverlapOfCorrections = 0.98;
};

/// Of a ball of so many nodes [nodes]: what is smaller is not judged.
inline constexpr double kLeastObjectRadius = 3;

template <int Dim>
constexpr double nodes_of_ball(double radius) {
  return Dim == 2 ? std::numbers::pi * radius * radius
                  : 4 * std::numbers::pi / 3 * radius * radius * radius;
}

/// A region: how much of each node of a box belongs to it, between 0 and 1.
template <int Dim>
struct Region {
  std::array<int, Dim> size;
  Eigen::Transform<double, Dim, Eigen::Affine> node_to_world;
  std::vector<float> share;  ///< 1 inside, 0 outside, blurred by one node; 0.5 is the boundary
  Family family;
  double mean;       ///< of the first seed [intensity]
  double low, high;  ///< ends of the window [intensity]; where it has none, of nearly all inside
  double neck_radius_mm;  ///< of the opening
  double node_mm;
  double score;  ///< larger is better; to compare regions of one search
  RungFeatures features;
};

/// 1 at the nodes inside and 0 outside, blurred by one node.
template <int Dim>
std::vector<float> shares(const NodeSet<Dim>& inside);

/// Of a rung of the view's grid.
template <int Dim>
Region<Dim> region_of(const SeedView<Dim>& view, const Rung<Dim>& rung);

/// A region that has been settled, with what its score has besides its boundary.
template <int Dim>
struct SettledRegion {
  Rung<Dim> rung;
  double besides = 1;
};

template <int Dim>
struct SearchedRegions {
  std::vector<SettledRegion<Dim>> settled;  ///< all, best first
  std::vector<Rung<Dim>> found;             ///< of these the best that differ and stand out
  bool was_stopped = false;
};

/// Called on the caller's own thread now and then; false stops.
/// @param n_done  steps done
/// @param seen    a region that has just been looked at; null if there is none to be shown
template <int Dim>
using SearchProgress = std::function<bool(int n_done, const Rung<Dim>* seen)>;

/// Ladders of three families climb (ladder.h); the best ten rungs that differ (with a box 16, and
/// least cuts from its faces) settle on the edges near their boundary (settle_cut.h), are scored
/// again (settled_score), and of those the best that differ are found.
///
/// O(windows (1 + neck radii) nodes in the component's box); one thread per window or region.
///
/// In a part of a grid what reaches a face beyond which the grid goes on is not found. It settles
/// last, and only if it may be better than the best that is found, which scores 0.7 or more.
///
/// @param seeds  world mm, in the image
/// @param stop   when it is requested, what has been found is judged
/// @return  best score first; none is found if no region of the size of a ball of 3 nodes or more
///          stands out from noise
template <int Dim>
SearchedRegions<Dim> search_rungs(const SearchGrid<Dim>& grid, std::span<const Vector<Dim>> seeds,
                                  const SearchOptions& options = {},
                                  const SearchProgress<Dim>& progress = {},
                                  const std::stop_token& stop = {});

/// search_rungs() in cubes of 49 and 73 nodes round the seed, then in the whole grid. A cube has
/// the last word if the best of its regions scores 0.7 or more and ends within it, and no other one
/// that reaches a face of the cube would be better had that not cut it off: if
///
///   score > score' exp(border share')
///
/// for all of these, which are left out then. So a small object takes the time of a small image,
/// and what is far away does not compete with it (docs/method.md).
///
/// In the plane, and with a box round the object, all of the grid is searched at once.
///
/// @param seed  world mm, in the image
/// @param stop  ends it with nothing found
template <int Dim>
SearchedRegions<Dim> search_outward(const SearchGrid<Dim>& grid, const Vector<Dim>& seed,
                                    const SearchOptions& options = {},
                                    const SearchProgress<Dim>& progress = {},
                                    const std::stop_token& stop = {});

}  // namespace surf::segment
