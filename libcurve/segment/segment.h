// From an image and seeds to curves.
#pragma once

#include <string>

#include "libcurve/image/image.h"
#include "libcurve/image/image_fields.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/segment/run.h"

namespace surf::curve {

/// What stays of the final curves: regions, in this order.
struct RegionFilter {
  bool fill_holes = false;  ///< first: holes go, with all that lies in them
  double min_area_mm2 = 0;  ///< then regions of less, with their holes
  mesh::Keep keep = mesh::Keep::kAll;
  std::vector<Vector<2>> seeds_mm;  ///< for kSeeded: regions that contain one; not in a hole

  std::string error() const;  ///< empty if valid
};

/// @param n_removed  regions and holes that went
/// @throws UsageError  filter.error() is not empty
Segments filtered(const Segments& curves, const RegionFilter& filter, int& n_removed);

struct CurveOptions : segment::RunOptions<2> {
  Interpolation interpolation = Interpolation::kSpline;
  RegionFilter regions;  ///< its seeds are ignored, those of the run count

  std::string error() const;  ///< empty if valid
};

using CurveResult = segment::RunResult<2>;
using CurveProgress = segment::ProgressOf<2>;

/// @throws UsageError  options.error() is not empty, a seed lies outside the image, an energy
///                     or one of its parameters is unknown
CurveResult segment(const Image& image, const CurveOptions& options,
                    const CurveProgress& progress = {});

/// The piecewise smooth u = u_1 chi_1 + u_2 chi_2 of the Mumford-Shah model at the pixel centres;
/// it jumps across the curves.
/// @param result  of segment(image, options), its shape not empty
/// @throws UsageError  mumford-shah is not among the result's energies
Image denoised(const Image& image, const CurveOptions& options, const CurveResult& result);

}  // namespace surf::curve
