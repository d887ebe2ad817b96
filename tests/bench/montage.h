// Pictures of studies: images in rows and columns, with curves over them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"

namespace surf::bench {

struct Panel {
  curve::Image image;
  Segments start;   ///< blue; may be empty
  Segments curves;  ///< orange; may be empty
  /// Values shown as black and white.
  std::array<double, 2> window;
  /// Greys are multiples of this; noise in 16 levels takes half the bytes that 256 take.
  int grey_step = 1;
};

/// Writes rows of panels as one PNG, each `width` pixels wide. Image pixels are repeated or passed
/// over, never mixed, so that noise looks as strong as it is.
/// @throws OutputError  the file cannot be written
void write_montage(const std::string& path, const std::vector<std::vector<Panel>>& rows, int width);

}  // namespace surf::bench
