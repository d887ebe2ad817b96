// Images, masks and pictures of curves over images as files.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"
#include "libsurf/io/picture.h"

namespace surf::curve {

/// True if `path` ends like an image that write_image writes: .png, .tif, .tiff.
bool is_writable_image(const std::string& path);

/// Writes an image, whole or not at all: .tif with the values as 32-bit floats and the pixel size,
/// or .png with the image's range mapped to 0..65535.
/// @throws UsageError, OutputError
void write_image(const std::string& path, const Image& image);

/// Writes a mask as an 8-bit grey PNG: 255 where `mask` is not 0.
/// @param mask  size[0] * size[1] values, i fastest
/// @throws UsageError, OutputError
void write_mask(const std::string& path, const std::array<int, 2>& size,
                std::span<const std::uint8_t> mask);

/// Writes labels as they are as an 8-bit grey PNG.
/// @param labels  as of write_mask()
/// @throws UsageError, OutputError
void write_labels(const std::string& path, const std::array<int, 2>& size,
                  std::span<const std::uint8_t> labels);

struct OverlayOptions {
  /// Values shown as black and white; if absent the 0.5 and 99.5 percentiles.
  std::optional<std::array<double, 2>> window;
  /// Each pixel becomes scale x scale; if absent so that the longer side has at least 800.
  std::optional<int> scale;
};

/// The curves drawn over the image, antialiased; needs no display.
io::Picture draw_overlay(const Image& image, const Segments& curves,
                         const OverlayOptions& options = {});

}  // namespace surf::curve
