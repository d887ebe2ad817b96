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
/// note; rows and columns are turned as the file's orientation says. Where the file states its
/// pixels' size (PNG, TIFF, the JFIF header of a JPEG) they have it.
/// @throws InputError  "path: what; what to do": missing, empty, truncated or damaged, no image,
///                     an unsupported kind, NaN or Inf, beyond memory, no such page
Image read_image(const std::string& path, const ReadImageOptions& options = {});

/// True if the file begins as a PNG, JPEG or TIFF does; false if it cannot be read.
bool is_image_file(const std::string& path);

}  // namespace surf::curve
