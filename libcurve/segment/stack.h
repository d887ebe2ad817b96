// Contours of consecutive slices of a volume, each started from the last one's.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "libcurve/image/slice.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/segment/segment.h"

namespace surf::curve {

struct StackResult {
  std::vector<SliceContours> slices;          ///< from the first to the last that has the object
  std::vector<segment::EnergyTerm> energies;  ///< chosen on the first slice, used on all
  std::vector<std::string> notes;             ///< slices at a limit, and why it ends early
  int n_limited = 0;                          ///< slices whose run ended at its limit of steps
  bool is_invalid = false;  ///< it ends early as contours fail a guarantee, not with the object
};

/// Called after every step of every slice; false ends the stack with the slice as it is.
using StackProgress =
    std::function<bool(int slice, const std::string& stage, const flow::StepRecord& record)>;

/// Segments slice `first`, then its neighbours one after the other to `last`, which may be less.
/// The first slice starts as the options say, each other one from the contours of the one before,
/// with the energy that was chosen on the first. Where the object vanishes or the contours are not
/// valid the stack ends before that slice, with a note.
/// @param options  seeds and initial curves in the plane of slice `first`
/// @throws UsageError, InputError  as segment() and, before any slice is worked,
/// VoxelSlices::slice()
StackResult segment_stack(const VoxelSlices& slices, int first, int last,
                          const CurveOptions& options, const StackProgress& progress = {});

/// 1 for the voxels of the slices' volume whose centres lie inside the contours.
std::vector<std::uint8_t> rasterized(const std::vector<SliceContours>& stack,
                                     const VoxelSlices& slices);

}  // namespace surf::curve
