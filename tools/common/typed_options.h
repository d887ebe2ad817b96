// Options of a segmentation from words as one types them after `surfseg segment` (Dim = 3) or
// `curveseg segment` (2).
#pragma once

#include <string>
#include <vector>

#include "libsurf/segment/options.h"

namespace surfseg {

/// Everything but clicks and initial surface: lengths such as "--edge-length", "2mm"; "--energy",
/// "chan-vese"; "--preset", "kidney-ct"; "--fill-cavities", "--fill-cavities=false" where a preset
/// may set it.
/// @param cell_mm  side of a cube of a voxel's volume or a square of a pixel's area, for lengths in
///                 voxels or pixels
/// @throws surf::UsageError  an option that there is not, or a value that it cannot have
/// @throws surf::InputError  the preset's file cannot be read
template <int Dim>
surf::segment::Options<Dim> typed_options(std::vector<std::string> words, double cell_mm);

}  // namespace surfseg
