#include "libcurve/image/read_image.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "libcurve/image/detail/raster.h"
#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"

namespace surf::curve {
namespace {

enum class Format { kNone, kPng, kJpeg, kTiff };

Format format_of(const std::string& bytes) {
  using namespace std::string_view_literals;  // which may hold zeros
  if (bytes.starts_with("\x89PNG\r\n\x1a\n"sv)) return Format::kPng;
  if (bytes.starts_with("\xff\xd8\xff"sv)) return Format::kJpeg;
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv)) return Format::kTiff;
  if (bytes.starts_with("II+\0"sv) || bytes.starts_with("MM\0+"sv)) return Format::kTiff;  // big
  return Format::kNone;
}

std::string first_bytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(8, '\0');
  stream.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(stream.gcount()));
  return bytes;
}

const char* name(Format format) {
  return format == Format::kPng ? "PNG" : format == Format::kJpeg ? "JPEG" : "TIFF";
}

Raster read_raster(const std::string& path, Format format, int page) {
  if (format == Format::kTiff) return read_tiff(path, page);
  if (page != 0)
    throw InputError(
        fmt::format("{}: there is no page {}; the file has 1, counted from 0", path, page));
  return format == Format::kPng ? read_png(path) : read_jpeg(path);
}

/// Luminance of the first three components, or the first alone.
std::vector<float> greys(Raster raster) {
  const int n = raster.n_components;
  if (n == 1) return std::move(raster.values);
  std::vector<float> out;
  out.reserve(raster.values.size() / n);
  for (std::size_t at = 0; at + n <= raster.values.size(); at += n) {
    const float* c = &raster.values[at];
    out.push_back(n < 3 ? c[0] : luminance(c[0], c[1], c[2]));
  }
  return out;
}

std::vector<std::string> notes_of(const Raster& raster, int page) {
  std::vector<std::string> notes;
  if (raster.n_components >= 3 || raster.is_luminance)
    notes.emplace_back("colors are turned into luminance: 0.2126 R + 0.7152 G + 0.0722 B");
  if (raster.n_components == 2 || raster.n_components == 4)
    notes.emplace_back("transparency is dropped");
  if (raster.orientation != 1)
    notes.push_back(
        fmt::format("rows and columns are turned as the file's orientation, {} of 1 to 8, says",
                    raster.orientation));
  if (raster.n_pages > 1)
    notes.push_back(fmt::format("the file has {} pages; this is page {}", raster.n_pages, page));
  return notes;
}

}  // namespace

InputError damaged(const std::string& path, const char* format, const std::string& why) {
  return InputError(fmt::format("{}: {} is truncated or damaged{}{}; get the file again", path,
                                format, why.empty() ? "" : ": ", why));
}

void check_promised(const std::string& path, const char* format, double n_bytes) {
  std::error_code status;
  const auto n_stored = double(std::filesystem::file_size(path, status));
  if (!status && !is_borne_out(n_bytes, n_stored))
    throw damaged(path, format,
                  fmt::format("its header promises {:.0f} bytes of pixels, the file has {:.0f}",
                              n_bytes, n_stored));
}

bool is_image_file(const std::string& path) {
  return format_of(first_bytes(path)) != Format::kNone;
}

Image read_image(const std::string& path, const ReadImageOptions& options) {
  if (!std::ifstream(path))
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  const std::string bytes = first_bytes(path);
  if (bytes.empty()) throw InputError(fmt::format("{}: is empty; get the file again", path));
  const Format format = format_of(bytes);
  if (format == Format::kNone)
    throw InputError(fmt::format("{}: not a PNG, JPEG or TIFF image", path));
  Raster raster = read_raster(path, format, options.page);
  ImageSource source;
  source.path = path;
  source.format = name(format);
  source.scalar_type = raster.scalar_type;
  source.spacing_source = options.spacing_mm ? "options" : raster.spacing_mm ? "file" : "unknown";
  source.notes = notes_of(raster, options.page);
  const Eigen::Vector2d spacing =
      options.spacing_mm.value_or(raster.spacing_mm.value_or(Eigen::Vector2d(1, 1)));
  const std::array<int, 2> size = raster.size;
  return Image(size, pixel_to_plane(spacing), greys(std::move(raster)), std::move(source));
}

}  // namespace surf::curve
