// Where an evolution starts if not from balls round the seeds: a file, or a body given by numbers.
#pragma once

#include <string>

#include "libsurf/segment/initial_surface.h"
#include "libsurf/volume/volume.h"
#include "tools/common/arguments.h"

namespace surfseg {

/// The --initial... options as they were typed; empty = not given.
struct InitialArguments {
  std::string file, ball, ellipsoid, box, landmarks;
  int label = 1;  ///< of `file`, if it is a label map

  bool any() const { return is_body() || !file.empty(); }
  bool is_body() const {
    return !(ball.empty() && ellipsoid.empty() && box.empty() && landmarks.empty());
  }
  /// What can be found wrong without the volume.
  /// @throws surf::UsageError  malformed, or more than one of them
  void check() const;
};

using surf::segment::InitialSurface;

/// The initial surface; points are in `space`, and the axes of an ellipsoid or box are those of
/// the space: the voxels' own for ijk. Landmarks give the ellipsoid next to them; those of a plain
/// text are in `space`, others in the space that their file states.
/// @param edge_length_mm  of a body's mesh; it is finer where the body is small
/// @throws surf::UsageError  as check()
/// @throws surf::InputError  the file is unreadable or not closed, manifold, outward and free of
///                           self-intersections, or nothing of the surface lies in the volume
InitialSurface make_initial_surface(const InitialArguments& arguments, Space space,
                                    const surf::volume::Volume& volume, double edge_length_mm);

}  // namespace surfseg
