// From a volume and seeds to a surface: the short way upon a Segmentation.
#pragma once

#include "libsurf/segment/segmentation.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

using SegmentOptions = Options<3>;
using SegmentResult = Result<3>;

/// Surfaces in a volume. The volume is shared, not copied.
std::shared_ptr<const Setting<3>> make_setting(const volume::Volume& volume);

/// The clicks of the short way: the seeds of the options and their outside points, in their order.
template <int Dim>
std::vector<Click<Dim>> clicks_of(const Options<Dim>& options);

/// One object, from the seeds of the options or its initial shape, that obeys their outside points.
/// @throws UsageError  options.error() is not empty, there is neither a seed nor an initial shape,
///                     a seed lies outside the image, an energy or one of its parameters is unknown
template <int Dim>
Result<Dim> segment(std::shared_ptr<const Setting<Dim>> setting, const Options<Dim>& options,
                    const ProgressOf<Dim>& progress = {}, const std::stop_token& stop = {});

inline SegmentResult segment(const volume::Volume& volume, const SegmentOptions& options,
                             const ProgressOf<3>& progress = {}, const std::stop_token& stop = {}) {
  return segment<3>(make_setting(volume), options, progress, stop);
}

}  // namespace surf::segment
