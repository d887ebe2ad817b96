#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "libcurve/image/detail/quiet_tiff.h"
#include "libcurve/image/detail/raster.h"
#include "libsurf/base/memory.h"

// VTK's reader turns rows upside down or not with their type (9.1).
namespace surf::curve {
namespace {

using File = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

struct Header {
  std::uint32_t width = 0, height = 0;
  std::uint16_t n_bits = 1, n_samples = 1, sample_format = SAMPLEFORMAT_UINT, photometric = 0,
                planar = PLANARCONFIG_CONTIG, orientation = ORIENTATION_TOPLEFT,
                compression = COMPRESSION_NONE;
};

Header read_header(TIFF* tiff) {
  Header h;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &h.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &h.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &h.n_bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &h.n_samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &h.sample_format);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &h.photometric);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &h.planar);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &h.orientation);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &h.compression);
  return h;
}

std::optional<Eigen::Vector2d> spacing_of(TIFF* tiff) {
  float x = 0, y = 0;
  std::uint16_t unit = RESUNIT_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_RESOLUTIONUNIT, &unit);
  if (!TIFFGetField(tiff, TIFFTAG_XRESOLUTION, &x) ||
      !TIFFGetField(tiff, TIFFTAG_YRESOLUTION, &y) || unit == RESUNIT_NONE || !(x > 0 && y > 0) ||
      !std::isfinite(x) || !std::isfinite(y))
    return std::nullopt;
  const double mm = unit == RESUNIT_CENTIMETER ? 10 : 25.4;
  return Eigen::Vector2d(mm / x, mm / y);
}

template <class T>
void append(const std::vector<unsigned char>& row, std::size_t n, std::vector<float>& values) {
  for (std::size_t at = 0; at < n; ++at) {
    T value;
    std::memcpy(&value, row.data() + at * sizeof(T), sizeof(T));
    values.push_back(static_cast<float>(value));
  }
}

using Append = void (*)(const std::vector<unsigned char>&, std::size_t, std::vector<float>&);
struct Type {
  const char* name;
  Append append;
};

/// Nothing for what only libtiff's own conversion to colors reads.
std::optional<Type> plain_type(const Header& h) {
  const bool is_plain =
      (h.planar == PLANARCONFIG_CONTIG || h.n_samples == 1) &&
      (h.photometric == PHOTOMETRIC_MINISBLACK || h.photometric == PHOTOMETRIC_RGB);
  if (!is_plain) return std::nullopt;
  const auto is = [&](int bits, int format) {
    return h.n_bits == bits && h.sample_format == format;
  };
  if (is(8, SAMPLEFORMAT_UINT)) return Type{"uint8", append<std::uint8_t>};
  if (is(8, SAMPLEFORMAT_INT)) return Type{"int8", append<std::int8_t>};
  if (is(16, SAMPLEFORMAT_UINT)) return Type{"uint16", append<std::uint16_t>};
  if (is(16, SAMPLEFORMAT_INT)) return Type{"int16", append<std::int16_t>};
  if (is(32, SAMPLEFORMAT_UINT)) return Type{"uint32", append<std::uint32_t>};
  if (is(32, SAMPLEFORMAT_INT)) return Type{"int32", append<std::int32_t>};
  if (is(64, SAMPLEFORMAT_UINT)) return Type{"uint64", append<std::uint64_t>};
  if (is(64, SAMPLEFORMAT_INT)) return Type{"int64", append<std::int64_t>};
  if (is(16, SAMPLEFORMAT_IEEEFP)) return Type{"float16", append<Eigen::half>};
  if (is(32, SAMPLEFORMAT_IEEEFP)) return Type{"float32", append<float>};
  if (is(64, SAMPLEFORMAT_IEEEFP)) return Type{"float64", append<double>};
  return std::nullopt;
}

void read_rows(TIFF* tiff, const Header& h, const Type& type, const std::string& path,
               Raster& out) {
  const std::size_t n = std::size_t(h.width) * h.n_samples;
  std::vector<unsigned char> row(std::max<std::size_t>(TIFFScanlineSize(tiff), n * (h.n_bits / 8)));
  for (std::uint32_t j = 0; j < h.height; ++j) {
    if (TIFFReadScanline(tiff, row.data(), j) < 0)
      throw damaged(path, "TIFF", fmt::format("row {} of {} cannot be read", j, h.height));
    type.append(row, n, out.values);
  }
}

/// Tiles side by side make a band of rows.
void read_tiles(TIFF* tiff, const Header& h, const Type& type, const std::string& path,
                Raster& out) {
  std::uint32_t width = 0, height = 0;
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &height);
  const std::size_t n_pixel = std::size_t(h.n_samples) * (h.n_bits / 8);  // bytes
  check_promised(path, "TIFF", double(width) * height * double(n_pixel));
  std::vector<unsigned char> tile(width * n_pixel * height), band;
  if (tile.empty() || TIFFTileSize(tiff) != std::ssize(tile))
    throw damaged(path, "TIFF", fmt::format("tiles of {} x {} pixels", width, height));
  for (std::uint32_t y = 0; y < h.height; y += height) {
    const std::size_t n_rows = std::min(height, h.height - y);
    band.resize(n_rows * h.width * n_pixel);
    for (std::uint32_t x = 0; x < h.width; x += width) {
      if (TIFFReadTile(tiff, tile.data(), x, y, 0, 0) < 0)
        throw damaged(path, "TIFF", fmt::format("the tile at {},{} cannot be read", x, y));
      for (std::size_t j = 0; j < n_rows; ++j)
        std::copy_n(&tile[j * width * n_pixel], std::min(width, h.width - x) * n_pixel,
                    &band[(j * h.width + x) * n_pixel]);
    }
    type.append(band, n_rows * h.width * h.n_samples, out.values);
  }
}

void read_plain(TIFF* tiff, const Header& h, const Type& type, const std::string& path,
                Raster& out) {
  out.values.reserve(std::size_t(h.width) * h.n_samples * h.height);
  (TIFFIsTiled(tiff) ? read_tiles : read_rows)(tiff, h, type, path, out);
  out.n_components = h.n_samples;
  out.scalar_type = type.name;
}

/// Unpacks all strips or tiles, each in its turn. A pixel of one bit takes 8 bytes as a colour:
/// room is made for what is there, not for what is promised.
void check_blocks(TIFF* tiff, const std::string& path) {
  const bool is_tiled = TIFFIsTiled(tiff) != 0;
  const tmsize_t n_bytes = is_tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff);
  check_promised(path, "TIFF", double(n_bytes));
  std::vector<unsigned char> block(std::size_t(std::max<tmsize_t>(n_bytes, 0)));
  const std::uint32_t n = is_tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  for (std::uint32_t k = 0; k < n; ++k)
    if ((is_tiled ? TIFFReadEncodedTile(tiff, k, block.data(), n_bytes)
                  : TIFFReadEncodedStrip(tiff, k, block.data(), n_bytes)) < 0)
      throw damaged(path, "TIFF", fmt::format("block {} of {} cannot be read", k, n));
}

InputError not_read(const Header& h, const std::string& path) {
  return InputError(fmt::format(
      "{}: TIFF is damaged or of a kind that is not read ({} bits, sample format {}, photometric "
      "{}, planar {}, compression {}); save it as plain grey or RGB",
      path, h.n_bits, h.sample_format, h.photometric, h.planar, h.compression));
}

void read_colors(TIFF* tiff, const Header& h, const std::string& path, Raster& out) {
  if (h.n_bits > 8) throw not_read(h, path);  // libtiff would drop all but the upper eight
  check_blocks(tiff, path);
  TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);  // pixels as they are stored
  std::vector<std::uint32_t> pixels(std::size_t(h.width) * h.height);
  if (!TIFFReadRGBAImageOriented(tiff, h.width, h.height, pixels.data(), ORIENTATION_TOPLEFT, 1))
    throw not_read(h, path);
  out.values.reserve(pixels.size());
  for (const std::uint32_t pixel : pixels)
    out.values.push_back(luminance(TIFFGetR(pixel), TIFFGetG(pixel), TIFFGetB(pixel)));
  out.is_luminance = true;
  out.scalar_type = "uint8";
}

/// What is not compressed is there whole: libtiff takes blocks that the file does not name from
/// anywhere. Pixels of less than a byte become floats, so that it is they that are counted, too.
void check_size(const Header& h, const std::string& path) {
  const double n_values = double(h.width) * h.height * h.n_samples;
  check_promised(path, "TIFF", n_values * h.n_bits / 8);
  std::error_code status;
  const auto n_stored = double(std::filesystem::file_size(path, status));
  // Colours may be stored for blocks of 4 x 4 pixels.
  const double n_least = h.photometric == PHOTOMETRIC_YCBCR ? n_values / h.n_samples : n_values;
  const bool is_cut = h.compression == COMPRESSION_NONE && n_least * h.n_bits / 8 > n_stored;
  const bool is_empty = h.n_bits < 8 && !is_borne_out(n_values, 8 * n_stored);
  if (!status && (is_cut || is_empty))
    throw damaged(
        path, "TIFF",
        fmt::format("its header promises {:.0f} bits of pixels, the file has {:.0f} bytes",
                    n_values * h.n_bits, n_stored));
}

}  // namespace

Raster read_tiff(const std::string& path, int page) {
  const QuietTiff quiet;
  const File tiff(TIFFOpen(path.c_str(), "r"), TIFFClose);
  if (!tiff) throw damaged(path, "TIFF");
  Raster out;
  out.n_pages = TIFFNumberOfDirectories(tiff.get());
  if (page < 0 || page >= out.n_pages)
    throw InputError(fmt::format("{}: there is no page {}; the file has {}, counted from 0", path,
                                 page, out.n_pages));
  if (!TIFFSetDirectory(tiff.get(), static_cast<tdir_t>(page))) throw damaged(path, "TIFF");
  const Header header = read_header(tiff.get());
  check_image_size({header.width, header.height}, path);
  check_size(header, path);
  out.size = {int(header.width), int(header.height)};
  out.spacing_mm = spacing_of(tiff.get());
  if (const auto type = plain_type(header))
    read_plain(tiff.get(), header, *type, path, out);
  else
    read_colors(tiff.get(), header, path, out);
  out.orientation = header.orientation;
  turn_upright(out);
  return out;
}

}  // namespace surf::curve
