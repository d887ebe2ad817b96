// What the boundary of a region looks like, on a ladder of wider and wider windows.
#pragma once

#include <span>

namespace surf::segment {

/// All invariant to the image's and the world's unit.
struct RungFeatures {
  double enclosed = 0;    ///< [mm^2] or [mm^3]
  double separation = 0;  ///< 1 - overlap of the histograms inside and outside the boundary
  double edge_share = 0;  ///< share of the length or area that lies on a maximum of |grad I|
  double sphericity = 0;  ///< measure of the ball of equal content / measure
  /// ln V / V of the rung before, 3/2 of ln A / A in the plane; of the first, which nobody has seen
  /// come to rest, as much as of a leak.
  double growth_in = 1.4;
  double growth_out = 1.4;  ///< the same of the rung after, at most 1.4
  /// separation * edge_share * sqrt(sphericity) * growth_out * exp(-growth_in / 4)
  double score() const;
};

/// 1 - sum min(p, q) over 32 bins between the 1st and 99th percentile of both together.
double histogram_separation(std::span<const float> inside, std::span<const float> outside);

/// The same from the counts of a fine histogram of each.
double histogram_separation(std::span<const int> inside, std::span<const int> outside);

}  // namespace surf::segment
