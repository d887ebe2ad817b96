#include "libsurf/io/detail/png_file.h"

#include <fmt/format.h>
#include <png.h>

#include <bit>
#include <csetjmp>
#include <new>
#include <utility>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::io {
namespace {

struct Png {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string bytes, message;

  ~Png() {
    if (png) png_destroy_write_struct(&png, &info);
  }
};

void remember_error(png_structp png, png_const_charp message) {
  static_cast<Png*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

void append(png_structp png, png_bytep data, std::size_t n) {
  try {
    static_cast<Png*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<const char*>(data), n);
  } catch (const std::bad_alloc&) {  // no exception may pass through libpng
    png_error(png, "no memory");
  }
}

void flush(png_structp) {}

/// May jump: no object with a destructor lives here.
bool write(Png& p, int width, int height, int n_components, int n_bits, png_bytepp rows) {
  if (setjmp(png_jmpbuf(p.png))) return false;
  png_set_write_fn(p.png, &p, append, flush);
  png_set_IHDR(p.png, p.info, png_uint_32(width), png_uint_32(height), n_bits,
               n_components == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(p.png, p.info);
  if (n_bits == 16 && std::endian::native == std::endian::little) png_set_swap(p.png);
  png_write_image(p.png, rows);
  png_write_end(p.png, nullptr);
  return true;
}

}  // namespace

std::string png_bytes(int width, int height, int n_components, int n_bits, const void* pixels) {
  const std::size_t row_bytes = std::size_t(width) * n_components * (n_bits / 8);
  std::vector<png_bytep> rows;
  for (int j = 0; j < height; ++j)  // libpng reads them alone, whatever its type says
    rows.push_back(static_cast<png_bytep>(const_cast<void*>(pixels)) + j * row_bytes);
  Png p;
  p.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &p, remember_error, ignore_warning);
  if (p.png) p.info = png_create_info_struct(p.png);
  if (!p.info) throw std::bad_alloc();
  if (!write(p, width, height, n_components, n_bits, rows.data()))
    throw OutputError(
        fmt::format("a PNG of {} x {} pixels cannot be made: {}", width, height, p.message));
  return std::move(p.bytes);
}

}  // namespace surf::io
