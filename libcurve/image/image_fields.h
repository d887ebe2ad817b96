// The fields that energies use: smoothed intensity and edge indicator of an image.
#pragma once

#include <memory>

#include "libcurve/image/image.h"
#include "libsurf/base/field.h"
#include "libsurf/volume/image_fields.h"

namespace surf::curve {

/// How a field is continued between its nodes.
enum class Interpolation {
  kSpline,  ///< C^2 cubic B-spline approximant, a blur of variance 1/3 pixel^2 (TiledField)
  kLinear   ///< bilinear, as the thesis 5.1.2: gradients jump at pixel borders, no second ones
};

/// How an image becomes a field.
struct FieldOptions {
  /// As for volumes; the grid is always that of the pixels.
  volume::SmoothingOptions smoothing = {};
  volume::DerivativeFilter filter = volume::DerivativeFilter::kBSpline;
  Interpolation interpolation = Interpolation::kSpline;
};

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
