#include "libcurve/image/write_image.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "libcurve/image/detail/quiet_tiff.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/png_file.h"
#include "libsurf/io/draw.h"

namespace surf::curve {
namespace {

/// A grey value for each pixel.
template <class T, class Value>
void write_grey_png(const std::string& path, const std::array<int, 2>& size, const Value& value) {
  if (extension(path) != ".png")
    throw UsageError(fmt::format("{}: expected a name that ends in .png", path));
  std::vector<T> pixels(std::size_t(size[0]) * size[1]);
  for (std::size_t at = 0; at < pixels.size(); ++at) pixels[at] = static_cast<T>(value(at));
  write_bytes(path, io::png_bytes(size[0], size[1], 1, 8 * sizeof(T), pixels.data()));
}

bool is_tiff(const std::string& path) {
  return extension(path) == ".tif" || extension(path) == ".tiff";
}

/// 32-bit floats without compression, and the spacing as resolution.
bool write_floats(TIFF* tiff, const Image& image) {
  const auto& size = image.size();
  bool is_good = true;
  const auto set = [&](auto tag, auto value) { is_good &= TIFFSetField(tiff, tag, value) == 1; };
  set(TIFFTAG_IMAGEWIDTH, std::uint32_t(size[0]));
  set(TIFFTAG_IMAGELENGTH, std::uint32_t(size[1]));
  set(TIFFTAG_BITSPERSAMPLE, 32);
  set(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  set(TIFFTAG_SAMPLESPERPIXEL, 1);
  set(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  set(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  set(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  set(TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff, 0));
  set(TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER);
  set(TIFFTAG_XRESOLUTION, 10 / image.spacing()[0]);
  set(TIFFTAG_YRESOLUTION, 10 / image.spacing()[1]);
  for (int j = 0; is_good && j < size[1]; ++j) {
    std::vector<float> row(size[0]);  // libtiff asks for bytes that it may change
    for (int i = 0; i < size[0]; ++i) row[i] = image.value(i, j);
    is_good = TIFFWriteScanline(tiff, row.data(), std::uint32_t(j), 0) == 1;
  }
  return is_good && TIFFFlush(tiff) == 1;
}

void write_tiff(const std::string& path, const Image& image) {
  write_atomically(path, [&](const std::string& temporary) {
    const QuietTiff quiet;
    const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(TIFFOpen(temporary.c_str(), "w"), TIFFClose);
    if (!tiff || !write_floats(tiff.get(), image))
      throw OutputError(fmt::format("{}: cannot be written", path));
  });
}

}  // namespace

bool is_writable_image(const std::string& path) {
  return is_tiff(path) || extension(path) == ".png";
}

void write_image(const std::string& path, const Image& image) {
  if (is_tiff(path)) return write_tiff(path, image);
  const auto [low, high] = image.range();
  const double scale = high > low ? 65535.0 / (double(high) - low) : 0;
  write_grey_png<std::uint16_t>(path, image.size(), [&, low = low](std::size_t at) {
    return std::lround(scale * (double(image.values()[at]) - low));
  });
}

void write_mask(const std::string& path, const std::array<int, 2>& size,
                std::span<const std::uint8_t> mask) {
  write_grey_png<std::uint8_t>(path, size, [&](std::size_t at) { return mask[at] != 0 ? 255 : 0; });
}

void write_labels(const std::string& path, const std::array<int, 2>& size,
                  std::span<const std::uint8_t> labels) {
  write_grey_png<std::uint8_t>(path, size, [&](std::size_t at) { return labels[at]; });
}

io::Picture draw_overlay(const Image& image, const Segments& curves,
                         const OverlayOptions& options) {
  constexpr int kLongSide = 800;
  const auto& size = image.size();
  const int scale = options.scale.value_or((kLongSide + std::max(size[0], size[1]) - 1) /
                                           std::max(size[0], size[1]));
  const auto [low, high] =
      options.window.value_or(io::automatic_window({image.values().begin(), image.values().end()}));
  io::Picture picture(size[0] * scale, size[1] * scale);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const double share = (image.value(x / scale, y / scale) - low) / (high - low);
      picture.at(x, y).fill(
          static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0))));
    }
  const auto place = [&](int vertex) -> Eigen::Vector2d {
    const Eigen::Vector2d pixel =
        image.plane_to_pixel() * Eigen::Vector2d(curves.points.row(vertex).transpose());
    return scale * (pixel.array() + 0.5) - 0.5;
  };
  io::Lines lines(picture.width(), picture.height());
  for (const auto element : curves.elements.rowwise())
    lines.add(place(element[0]), place(element[1]));
  lines.draw(picture, io::kOutline);
  return picture;
}

}  // namespace surf::curve
