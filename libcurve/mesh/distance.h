// Distances between curves, and from curves to a known shape.
#pragma once

#include <functional>
#include <memory>

#include "libsurf/base/types.h"
#include "libsurf/mesh/distance_statistics.h"

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

using mesh::DistanceOptions;
using mesh::DistanceStatistics;
using CurveDistances = mesh::SymmetricDistances;

/// From the points of `curves` to a shape given by its distance function [mm], signed or not.
/// @throws InvalidMesh  the curves have no length
DistanceStatistics distances_from(const Segments& curves,
                                  const std::function<double(const Vector<2>&)>& distance,
                                  const DistanceOptions& options = {});

/// @throws InvalidMesh  curves have no length
CurveDistances curve_distances(const Segments& first, const Segments& second,
                               const DistanceOptions& options = {});

}  // namespace surf::curve
