// Distances between curves, and from curves to a known shape.
#pragma once

#include <functional>
#include <memory>

#include "libsurf/base/types.h"

namespace surf::curve {

/// Distance from points to curves, by a tree of boxes. Immutable after construction; calls are
/// thread-safe.
class DistanceToCurves {
 public:
  /// @throws InvalidMesh  no element
  explicit DistanceToCurves(const Segments& curves);
  ~DistanceToCurves();
  DistanceToCurves(DistanceToCurves&&) noexcept;

  double operator()(const Vector<2>& point) const;  ///< unsigned [mm]

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct DistanceOptions {
  /// Samples per set of curves, spread evenly over its length.
  int n_samples = 100000;
};

/// Distances of the points of one set of curves from another shape [mm].
struct DistanceStatistics {
  double mean_mm = 0, rms_mm = 0;  ///< over the length
  double p95_mm = 0;               ///< 95 % of the length is nearer
  double max_mm = 0;               ///< over samples and nodes
  double signed_mean_mm = 0;       ///< with the signs of the distance function: the bias
};

/// From the points of `curves` to a shape given by its distance function [mm], signed or not.
/// @throws InvalidMesh  the curves have no length
DistanceStatistics distances_from(const Segments& curves,
                                  const std::function<double(const Vector<2>&)>& distance,
                                  const DistanceOptions& options = {});

/// Symmetric distance.
struct CurveDistances {
  DistanceStatistics forward;      ///< from points of the first set to the second
  DistanceStatistics backward;     ///< and back
  double mean_mm = 0, rms_mm = 0;  ///< over both lengths together
  double p95_mm = 0, max_mm = 0;   ///< the larger of both directions (HD95, Hausdorff)
};

/// @throws InvalidMesh  curves have no length
CurveDistances curve_distances(const Segments& first, const Segments& second,
                               const DistanceOptions& options = {});

}  // namespace surf::curve
