// Distances between surfaces, and from a surface to a known shape.
#pragma once

#include <functional>
#include <memory>

#include "libsurf/base/types.h"
#include "libsurf/mesh/distance_statistics.h"

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

/// From the points of `surface` to a shape given by its distance function [mm], signed or not.
/// The function is called from several threads at once.
/// @throws InvalidMesh  the surface has no area
DistanceStatistics distances_from(const Triangles& surface,
                                  const std::function<double(const Vector<3>&)>& distance,
                                  const DistanceOptions& options = {});

using SurfaceDistances = SymmetricDistances;

/// @throws InvalidMesh  a surface has no area
SurfaceDistances surface_distances(const Triangles& first, const Triangles& second,
                                   const DistanceOptions& options = {});

}  // namespace surf::mesh
