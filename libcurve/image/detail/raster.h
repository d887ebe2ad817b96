// What the readers of image files share; private to libcurve/read_*.cpp.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libcurve/image/image.h"
#include "libcurve/image/read_image.h"
#include "libsurf/base/error.h"

namespace surf::curve {

/// An image as it stands in a file.
struct Raster {
  std::array<int, 2> size;
  int n_components = 1;
  std::string scalar_type;    ///< "uint8", ...
  std::vector<float> values;  ///< components together, columns fastest, row 0 on top
  bool is_luminance = false;  ///< the values are that of colours already
  std::optional<Eigen::Vector2d> spacing_mm;
  int n_pages = 1;
  int orientation = 1;  ///< as stored, of TIFF and EXIF, 1 to 8
};

/// Rows and columns as they are to be seen: where the first row and column of the file lie says
/// its orientation (TIFF 6.0, p. 36: 1 top and left, 2 top and right, ..., 8 left and bottom);
/// sizes and spacing go with them.
void turn_upright(Raster& raster);

/// The orientation in a block of EXIF, a header of TIFF with its first list of fields: 1 if it has
/// none or cannot be read.
int orientation_of_exif(std::string_view exif);

/// Rec. 709.
inline float luminance(double red, double green, double blue) {
  return static_cast<float>(0.2126 * red + 0.7152 * green + 0.0722 * blue);
}

/// @throws InputError  as read_image()
Raster read_png(const std::string& path);
Raster read_jpeg(const std::string& path);
Raster read_tiff(const std::string& path, int page);

/// What a header promises is believed as far as the file's bytes bear it out.
/// @throws InputError  see is_borne_out()
void check_promised(const std::string& path, const char* format, double n_bytes);

/// "path: PNG is truncated or damaged: why; get the file again"
InputError damaged(const std::string& path, const char* format, const std::string& why = {});

}  // namespace surf::curve
