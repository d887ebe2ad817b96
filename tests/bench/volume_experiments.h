// The experiments of thesis 5.1.3: two touching balls and a rectangular prism, found by the
// weighted H1 flow of (5.1) from a coarse sphere of radius 1.
#pragma once

#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::bench {

constexpr double kGeometryTolerance = 0.02;  // epsilon_geom of 5.1

/// On [-1, 1]^3 mm.
inline volume::PhantomOptions phantom_of(volume::PhantomKind kind, int size) {
  volume::PhantomOptions phantom;
  phantom.kind = kind;
  phantom.size = {size, size, size};
  return phantom;
}

/// gamma = 0.
inline segment::SegmentOptions options_of_thesis(double voxel_mm) {
  segment::SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 1, 0.4);
  options.energies = {{"minimal-surface", 1, {{"gamma", 0}, {"lambda", 2.8}}}};
  options.sigma_mm = 1.5 * voxel_mm;  // at 128^3 voxels half the half-width of the edges
  options.edge_length_mm = 0.75 * voxel_mm;
  options.coarseness = 24;
  options.geometry_tolerance_mm = kGeometryTolerance;
  return options;
}

}  // namespace surf::bench
