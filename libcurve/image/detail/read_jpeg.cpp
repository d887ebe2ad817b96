#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <csetjmp>
#include <cstring>
#include <fstream>
#include <string_view>

// jpeglib.h names FILE, which <cstdio> has.
// clang-format off
#include <cstdio>
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include "libcurve/image/detail/raster.h"

namespace surf::curve {
namespace {

constexpr int kExif = JPEG_APP0 + 1;
constexpr std::string_view kExifName("Exif\0\0", 6);

/// Reads errors and those warnings that mean that pixels are missing or wrong.
struct Jpeg {
  jpeg_decompress_struct info = {};
  jpeg_error_mgr errors = {};
  jpeg_progress_mgr progress = {};
  std::jmp_buf failure;
  std::string message;

  Jpeg() {
    info.err = jpeg_std_error(&errors);
    info.client_data = this;
    errors.error_exit = [](j_common_ptr any) { fail(any); };
    errors.emit_message = [](j_common_ptr any, int level) {
      const int code = any->err->msg_code;
      if (level < 0 &&
          (code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE || code == JWRN_JPEG_EOF))
        fail(any);
    };
    // Each scan of a progressive file passes over the whole image: thousands of them take hours.
    progress.progress_monitor = [](j_common_ptr any) {
      constexpr int kMostScans = 500;
      if (reinterpret_cast<j_decompress_ptr>(any)->input_scan_number > kMostScans) fail(any);
    };
  }
  ~Jpeg() { jpeg_destroy_decompress(&info); }
  Jpeg(const Jpeg&) = delete;
  Jpeg& operator=(const Jpeg&) = delete;

  [[noreturn]] static void fail(j_common_ptr any) {
    Jpeg& jpeg = *static_cast<Jpeg*>(any->client_data);
    char reason[JMSG_LENGTH_MAX];
    jpeg.errors.format_message(any, reason);
    jpeg.message = reason;
    std::longjmp(jpeg.failure, 1);
  }
};

/// Everything that may jump: no object with a destructor lives in these two functions.
bool read_header(Jpeg& jpeg, const std::string& content) {
  if (setjmp(jpeg.failure)) return false;
  jpeg_create_decompress(&jpeg.info);
  jpeg.info.progress = &jpeg.progress;
  jpeg_mem_src(&jpeg.info, reinterpret_cast<const unsigned char*>(content.data()), content.size());
  jpeg_save_markers(&jpeg.info, kExif, 0xffff);
  jpeg_read_header(&jpeg.info, /*require_image=*/TRUE);
  if (jpeg.info.jpeg_color_space == JCS_YCbCr) jpeg.info.out_color_space = JCS_RGB;
  jpeg_calc_output_dimensions(&jpeg.info);
  return true;
}

bool read_rows(Jpeg& jpeg, JSAMPLE* row, float* values) {
  if (setjmp(jpeg.failure)) return false;
  jpeg_start_decompress(&jpeg.info);
  const std::size_t n = std::size_t(jpeg.info.output_width) * jpeg.info.output_components;
  while (jpeg.info.output_scanline < jpeg.info.output_height) {
    const std::size_t j = jpeg.info.output_scanline;
    jpeg_read_scanlines(&jpeg.info, &row, 1);
    std::copy_n(row, n, values + j * n);
  }
  jpeg_finish_decompress(&jpeg.info);
  return true;
}

int orientation_of(const jpeg_decompress_struct& info) {
  for (const auto* marker = info.marker_list; marker; marker = marker->next) {
    std::string_view block(reinterpret_cast<const char*>(marker->data),
                           std::size_t(marker->data_length));
    if (marker->marker != kExif || !block.starts_with(kExifName)) continue;  // XMP, say
    block.remove_prefix(kExifName.size());
    return orientation_of_exif(block);
  }
  return 1;
}

/// Of the JFIF header; nothing where it says the pixels' proportions alone.
std::optional<Eigen::Vector2d> spacing_of(const jpeg_decompress_struct& info) {
  constexpr int kPerInch = 1, kPerCentimetre = 2;
  const bool has_unit = info.density_unit == kPerInch || info.density_unit == kPerCentimetre;
  if (!info.saw_JFIF_marker || !has_unit || info.X_density == 0 || info.Y_density == 0)
    return std::nullopt;
  const double mm = info.density_unit == kPerInch ? 25.4 : 10;
  return Eigen::Vector2d(mm / info.X_density, mm / info.Y_density);
}

std::string content_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  std::string content(std::size_t(std::max<std::streamoff>(stream.tellg(), 0)), '\0');
  stream.seekg(0);
  if (!stream.read(content.data(), std::streamsize(content.size())))
    throw InputError(path + ": cannot be read: " + std::strerror(errno));
  return content;
}

/// libjpeg fills what is missing with grey; the end's mark tells.
void check_end(const std::string& content, const std::string& path) {
  constexpr std::size_t kTail = 4096;  // some cameras append a few bytes
  const std::size_t at = content.rfind("\xff\xd9");
  if (at == std::string::npos || content.size() - at > kTail)
    throw damaged(path, "JPEG", "its end is missing");
}

/// A block of 8 x 8 pixels takes a bit at least (Huffman's codes have no less).
void check_blocks(const std::array<int, 2>& size, const std::string& content,
                  const std::string& path) {
  if (double(size[0]) * size[1] > 512.0 * double(content.size()))
    throw damaged(path, "JPEG",
                  fmt::format("its header promises {} x {} pixels, the file has {} bytes", size[0],
                              size[1], content.size()));
}

}  // namespace

Raster read_jpeg(const std::string& path) {
  const std::string content = content_of(path);
  check_end(content, path);
  Jpeg jpeg;
  if (!read_header(jpeg, content)) throw damaged(path, "JPEG", jpeg.message);
  if (jpeg.info.out_color_space == JCS_CMYK)
    throw InputError(path + ": a JPEG of four printing colours (CMYK); save it in grey or RGB");
  check_image_size({jpeg.info.output_width, jpeg.info.output_height}, path);
  Raster out;
  out.size = {int(jpeg.info.output_width), int(jpeg.info.output_height)};
  check_blocks(out.size, content, path);
  out.n_components = jpeg.info.output_components;
  out.scalar_type = "uint8";
  const std::size_t n_row = std::size_t(out.size[0]) * out.n_components;
  std::vector<JSAMPLE> row(n_row);
  out.values.resize(n_row * out.size[1]);
  out.spacing_mm = spacing_of(jpeg.info);
  out.orientation = orientation_of(jpeg.info);
  if (!read_rows(jpeg, row.data(), out.values.data())) throw damaged(path, "JPEG", jpeg.message);
  turn_upright(out);
  return out;
}

}  // namespace surf::curve
