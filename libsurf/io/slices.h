// Slices through a volume with a surface's outline and the clicks that made it; needs no display.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/io/picture.h"
#include "libsurf/volume/volume.h"

namespace surf::io {

/// A point that was given: inside the object or outside.
struct Mark {
  Vector<3> point_ras_mm;
  bool is_inside = true;
};

struct SliceOptions {
  /// Point all three slices pass through [mm, RAS]; the surface's centroid if absent. Where it is
  /// farther out than the centre of a border voxel, through that.
  std::optional<Vector<3>> center_ras_mm = {};
  /// Values shown as black and white; if absent the 0.5 and 99.5 percentiles of the values in
  /// the shown part.
  std::optional<std::array<double, 2>> window = {};
  /// Width of the picture in pixels.
  int width = 1500;
  std::vector<Mark> marks = {};
};

/// The axial, coronal and sagittal slice side by side at one scale, grey values by linear
/// interpolation along the world's axes, so that spacing and obliqueness are as in the world.
/// Seen as radiologists do: the patient's right on the picture's left in the axial
/// and coronal slice, anterior on the left in the sagittal one; letters name the sides, and a
/// letter and millimetres where the slice lies (S12.5: 12.5 mm superior of the origin). What is
/// shown is the volume near the surface: its bounding box and as much again round it, and the
/// marks.
///
/// A mark is a cross, green inside and pink outside, where it lies in the slice, that is within
/// half a voxel of it, else a ring where it lies in front or behind.
///
/// O(pixels + triangles).
/// @throws UsageError  width < 100, an empty window, or the slices miss the volume
Picture draw_slices(const Triangles& surface, const volume::Volume& volume,
                    const SliceOptions& options = {});

enum class SlicePlane { kAxial, kCoronal, kSagittal };

struct SheetOptions {
  SlicePlane plane = SlicePlane::kAxial;
  int n_slices = 12, columns = 4;
  std::optional<std::array<double, 2>> window = {};  ///< as SliceOptions
  int width = 1500;                                  ///< of the picture in pixels
  std::vector<Mark> marks = {};
};

/// Slices across one axis in so many columns, spread evenly over the surface: from superior to
/// inferior, anterior to posterior, or right to left, row by row. Scale, sides, letters and what is
/// shown are those of draw_slices(). A mark is a cross in the slice next to it.
/// @throws UsageError  as draw_slices(); fewer than one column or slice, more than 400 slices,
///                     or slices of fewer than 32 pixels
Picture draw_sheet(const Triangles& surface, const volume::Volume& volume,
                   const SheetOptions& options = {});

/// Values shown as black and white by the name that radiologists use for CT, in HU: soft-tissue,
/// bone, lung, brain.
std::optional<std::array<double, 2>> ct_window(const std::string& name);
/// Their names.
const std::vector<std::string>& ct_windows();

}  // namespace surf::io
