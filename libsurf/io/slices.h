// Three orthogonal slices through a volume with a surface's outline; needs no display.
#pragma once

#include <optional>

#include "libsurf/base/types.h"
#include "libsurf/io/picture.h"
#include "libsurf/volume/volume.h"

namespace surf::io {

struct SliceOptions {
  /// Point all three slices pass through [mm, RAS]; the surface's centroid if absent.
  std::optional<Vector<3>> center_ras_mm = {};
  /// Values shown as black and white; if absent the 0.5 and 99.5 percentiles of the values in
  /// the shown part.
  std::optional<std::array<double, 2>> window = {};
  /// Width of the picture in pixels.
  int width = 1500;
};

/// The axial, coronal and sagittal slice side by side at one scale, grey values by linear
/// interpolation along the world's axes, so that spacing and obliqueness are as in the world.
/// Seen as radiologists do: the patient's right on the picture's left in the axial
/// and coronal slice, anterior on the left in the sagittal one; letters name the sides. What is
/// shown is the volume near the surface: its bounding box and as much again round it.
///
/// O(pixels + triangles).
/// @throws UsageError  width < 100, an empty window, or the slices miss the volume
Picture draw_slices(const Triangles& surface, const volume::Volume& volume,
                    const SliceOptions& options = {});

}  // namespace surf::io
