// Images from files: PNG, JPEG, TIFF.
#pragma once

#include <optional>
#include <string>

#include "libcurve/image/image.h"

namespace surf::curve {

struct ReadImageOptions {
  /// Pixel size [mm]; none = what the file states, else 1.
  std::optional<Eigen::Vector2d> spacing_mm = {};
  /// Page of a TIFF file, from 0.
  int page = 0;
};

/// Reads an image of 8, 16 or 32 bits; the format is recognised by the file's content. Colors
/// become luminance (Rec. 709, on the values as stored) and transparency is dropped, each with a
/// note. PNG and TIFF may state a pixel size; a JPEG's is a matter of printing and not used.
/// @throws InputError  "path: what; what to do": missing, empty, truncated or damaged, no image,
///                     an unsupported kind, NaN or Inf, beyond memory, no such page
Image read_image(const std::string& path, const ReadImageOptions& options = {});

/// True if the file begins as a PNG, JPEG or TIFF does; false if it cannot be read.
bool is_image_file(const std::string& path);

}  // namespace surf::curve
