// The fields that energies use: smoothed intensity and edge indicator of an image.
#pragma once

#include <memory>

#include "libcurve/image/image.h"
#include "libsurf/base/field.h"
#include "libsurf/volume/image_fields.h"

namespace surf::curve {

using volume::FieldOptions;  ///< the grid is always that of the pixels
using volume::Interpolation;

/// Smoothed intensities. Outside the image a field is continued constantly.
/// @throws UsageError  options.smoothing.error() is not empty
std::shared_ptr<const Field<2>> intensity_field(const Image& image, const FieldOptions& options);

/// P with da P = I, a the step from a pixel's centre to the next column's and I the intensity
/// field: the integral of I along the columns from the first one, exact. The value only, no
/// derivatives.
/// @param options  with Interpolation::kSpline
std::shared_ptr<const Field<2>> intensity_antiderivative(const Image& image,
                                                         const FieldOptions& options);

/// Edge indicator H = 1 / (1 + |grad I|^2 / lambda^2), thesis (5.1): computed at the pixels from
/// the smoothed intensities and then interpolated, so that grad H and D2H are those of one
/// function.
/// @param lambda  edge strength [intensity / mm], > 0
std::shared_ptr<const Field<2>> edge_indicator(const Image& image, const FieldOptions& options,
                                               double lambda);

}  // namespace surf::curve
