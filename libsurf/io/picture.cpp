#include "libsurf/io/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/jpeg_file.h"
#include "libsurf/io/detail/png_file.h"

namespace surf::io {

void Picture::blend(int x, int y, Color color, double weight) {
  if (!contains(x, y)) return;
  weight = std::clamp(weight, 0.0, 1.0);
  Color& pixel = at(x, y);
  for (int channel = 0; channel < 3; ++channel)
    pixel[channel] = static_cast<std::uint8_t>(
        std::lround((1 - weight) * pixel[channel] + weight * color[channel]));
}

void Picture::paste(const Picture& other, int x, int y) {
  assert(x >= 0 && y >= 0 && x + other.width() <= width_ && y + other.height() <= height_);
  for (int row = 0; row < other.height(); ++row)
    std::copy_n(&other.at(0, row), other.width(), &at(x, y + row));
}

void write_png(const std::string& path, const Picture& picture) {
  if (extension(path) != ".png")
    throw UsageError(fmt::format("{}: pictures are written as .png only", path));
  write_bytes(path, png_bytes(picture.width(), picture.height(), 3, 8, &picture.at(0, 0)));
}

std::string jpeg_bytes(const Picture& picture, int quality) {
  return jpeg_bytes(picture.width(), picture.height(), picture.at(0, 0).data(), quality);
}

}  // namespace surf::io
