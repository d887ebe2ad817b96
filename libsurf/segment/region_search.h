// One seed in a volume, no options: regions of a grid that may be the object, best first. They say
// which object is meant and where it leaks; where its boundary is, a surface finds from there.
// See docs/method.md for why.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

struct RegionSearchOptions {
  /// Neck radii r [nodes]: what hangs on by a neck that is thinner is cut off.
  std::vector<double> neck_radii = {1, 1.5, 2, 3, 4, 6};
  /// The grid is as fine as cubes of the voxels' content, or as about so many nodes allow. Then
  /// what is found depends on the field of view, by a fraction of a node.
  double max_nodes = 1.5e6;
  /// Regions to return. They differ: no two have more than kMostOverlap in common.
  int max_regions = 4;
  static constexpr double kMostOverlap = 0.8;  // Dice
};

/// A region: how much of each node of a grid belongs to it, between 0 and 1.
struct Region {
  volume::Volume share;   ///< 1 inside, 0 outside, blurred by one node; 0.5 is the boundary
  double half_width;      ///< of the window [intensity]
  double neck_radius_mm;  ///< of the opening
  double score;           ///< larger is better; to compare regions of one search
};

/// Wider and wider windows |I - mean| <= a = deviation 2^(q/2), q = 2, 3, ..., on an isotropic
/// grid; with several seeds the mean is that of one of them, whichever is nearest. Of each the
/// component M of the seeds, and of that for each r the opening: the part of {x in M: distance to
/// the outside > r} that holds the seeds or is within 8 nodes of them, and what lies within r of it
/// in M, its holes filled. Each (a, r) is scored by what its boundary looks like, and by its growth
/// from the window before and to the next.
///
/// O(windows (1 + neck radii) nodes in the component's box); one thread per window.
///
/// @param I         intensities, blurred by about 0.7 voxels
/// @param models    of each seed; the least deviation counts
/// @param seeds     RAS mm, in the volume
/// @param progress  called after each window with the number of those done, never by two threads at
///                  once; false stops, and what has been found is judged
/// @return  best score first; empty if no region reaches the size of a ball of 3 nodes
std::vector<Region> search_regions(const Field<3>& I, const ImageExtent<3>& extent,
                                   std::span<const SeedModel> models,
                                   std::span<const Vector<3>> seeds,
                                   const RegionSearchOptions& options,
                                   const std::function<bool(int n_done)>& progress);

}  // namespace surf::segment
