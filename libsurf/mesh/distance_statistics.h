// Statistics of distances between shapes, of curves in the plane and surfaces in space alike.
#pragma once

#include <vector>

namespace surf::mesh {

struct DistanceOptions {
  /// Samples per shape, spread evenly over its area or length: the k-th lies where this, summed
  /// over the elements, reaches (k + 1/2) / n; in its triangle it is placed by the k-th point of a
  /// low-discrepancy sequence. The error of a mean is about its scatter / n.
  int n_samples = 100000;
};

/// Distances of one shape's points from another shape [mm].
struct DistanceStatistics {
  double mean_mm = 0, rms_mm = 0;  ///< over the area or length
  double p95_mm = 0;               ///< 95 % of it is nearer
  double max_mm = 0;               ///< over samples and vertices
  /// Mean with the signs of the distance function: the bias. Equal to mean_mm where
  /// distances have no sign.
  double signed_mean_mm = 0;
};

/// @param at_samples   distances, > 0 samples
/// @param at_vertices  distances, for the largest one
DistanceStatistics distance_statistics(std::vector<double> at_samples,
                                       const std::vector<double>& at_vertices);

/// Symmetric distance of two shapes: what segmentation papers report.
struct SymmetricDistances {
  DistanceStatistics forward;   ///< from points of the first shape to the second
  DistanceStatistics backward;  ///< and back
  double mean_mm = 0;           ///< over both together (ASSD)
  double rms_mm = 0;            ///< over both together
  double p95_mm = 0;            ///< the larger of both directions (HD95)
  double max_mm = 0;            ///< the larger of both directions (Hausdorff)
};

/// @param first, second  the areas or lengths
SymmetricDistances symmetric_distances(const DistanceStatistics& forward, double first,
                                       const DistanceStatistics& backward, double second);

}  // namespace surf::mesh
