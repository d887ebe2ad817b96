// Distances between surfaces, and from a surface to a known shape.
#pragma once

#include <functional>
#include <memory>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Distance from points to a triangle surface, by CGAL's tree of boxes. Immutable after
/// construction; calls are thread-safe.
class DistanceToSurface {
 public:
  /// @throws InvalidMesh  no triangle with an area
  explicit DistanceToSurface(const Triangles& surface);
  ~DistanceToSurface();
  DistanceToSurface(DistanceToSurface&&) noexcept;

  /// Unsigned distance [mm]; O(log triangles).
  double operator()(const Vector<3>& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct DistanceOptions {
  /// Samples per surface, spread evenly over its area: the k-th lies where the area summed over the
  /// triangles reaches (k + 1/2) / n, placed in its triangle by the k-th point of a
  /// low-discrepancy sequence. The error of a mean is about its scatter / n.
  int n_samples = 100000;
};

/// Distances of one surface's points from another shape [mm].
struct DistanceStatistics {
  double mean_mm = 0, rms_mm = 0;  ///< over the area
  double p95_mm = 0;               ///< 95 % of the area is nearer
  double max_mm = 0;               ///< over samples and vertices
  /// Mean with the signs of the distance function: the bias. Equal to mean_mm where
  /// distances have no sign.
  double signed_mean_mm = 0;
};

/// From the points of `surface` to a shape given by its distance function [mm], signed or not.
/// The function is called from several threads at once.
/// @throws InvalidMesh  the surface has no area
DistanceStatistics distances_from(const Triangles& surface,
                                  const std::function<double(const Vector<3>&)>& distance,
                                  const DistanceOptions& options = {});

/// Symmetric surface distance: what segmentation papers report.
struct SurfaceDistances {
  DistanceStatistics forward;   ///< from points of the first surface to the second
  DistanceStatistics backward;  ///< and back
  double mean_mm = 0;           ///< over both areas together (ASSD)
  double rms_mm = 0;            ///< over both areas together
  double p95_mm = 0;            ///< the larger of both directions (HD95)
  double max_mm = 0;            ///< the larger of both directions (Hausdorff)
};

/// @throws InvalidMesh  a surface has no area
SurfaceDistances surface_distances(const Triangles& first, const Triangles& second,
                                   const DistanceOptions& options = {});

}  // namespace surf::mesh
