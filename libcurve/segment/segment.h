// From an image and seeds to curves: the short way upon a segment::Segmentation.
#pragma once

#include "libcurve/image/image.h"
#include "libcurve/segment/region_filter.h"
#include "libsurf/segment/segment.h"

namespace surf::curve {

using CurveOptions = segment::Options<2>;
using CurveResult = segment::Result<2>;

/// Curves in an image. Its values are shared, not copied.
std::shared_ptr<const segment::Setting<2>> make_setting(const Image& image);

/// See segment::segment().
inline CurveResult segment(const Image& image, const CurveOptions& options,
                           const segment::ProgressOf<2>& progress = {},
                           const std::stop_token& stop = {}) {
  return segment::segment<2>(make_setting(image), options, progress, stop);
}

/// The piecewise smooth u = u_1 chi_1 + u_2 chi_2 of the Mumford-Shah model at the pixel centres;
/// it jumps across the curves.
/// @param result  of segment(image, options), its shape not empty
/// @throws UsageError  mumford-shah is not among the result's energies
Image denoised(const Image& image, const CurveOptions& options, const CurveResult& result);

}  // namespace surf::curve
