// A volume for the page: what its views show, and the NIfTI file they read.
#pragma once

#include <array>
#include <string>

#include "libsurf/volume/volume.h"

namespace surfseg::studio {

/// How the views show a volume.
struct Display {
  bool is_ct = false;  ///< values are whole and reach below -200, as in Hounsfield units
  /// Black and white: of a CT soft tissue, or lung and soft tissue where there is much lung; else
  /// all but a thousandth of the voxels at both ends.
  std::array<double, 2> window = {};
  /// Along each axis at most, so that they have at most 512 MB of voxels and 2048 along an axis:
  /// along the longest ones.
  std::array<int, 3> coarser_by = {1, 1, 1};
};

Display display_of(const surf::volume::Volume& volume);

/// NIfTI-1, gzip: the affine as sform, values as uint8 or int16 if all are such whole numbers, else
/// as int16 with a slope that keeps 1/65000 of their range. Coarser ones are means of blocks, which
/// fill the volume's own box: size / coarser_by of them along each axis, rounded up.
std::string volume_file(const surf::volume::Volume& volume, const std::array<int, 3>& coarser_by);

}  // namespace surfseg::studio
