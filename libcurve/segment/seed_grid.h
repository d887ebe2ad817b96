// Many circles to start from, where the image shows objects.
#pragma once

#include <optional>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"

namespace surf::curve {

struct SeedGridOptions {
  double spacing_mm = 1;            ///< of the circles' centres
  std::optional<double> radius_mm;  ///< none = 0.3 of the spacing
  double edge_length_mm = 1;        ///< at most; half the radius if that is less
  bool are_dark = false;            ///< objects are darker than the image's mean, not brighter

  std::string error() const;  ///< empty if valid
};

/// Circles on a grid over the image at whose centre it is brighter, or darker, than its mean: those
/// all over it would lie as much in the background, and regions that compete might as well take
/// that for the object.
/// @throws UsageError  options.error() is not empty, more than a million circles, or none is left
Segments seed_grid(const Image& image, const SeedGridOptions& options);

}  // namespace surf::curve
