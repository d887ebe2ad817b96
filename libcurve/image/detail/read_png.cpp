#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

#include "libcurve/image/detail/raster.h"

// VTK's reader ends the process where libpng meets a damaged file.
namespace surf::curve {
namespace {

struct Png {
  std::FILE* file = nullptr;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string message;

  ~Png() {
    if (png) png_destroy_read_struct(&png, &info, nullptr);
    if (file) std::fclose(file);
  }
};

void remember_error(png_structp png, png_const_charp message) {
  static_cast<Png*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// What the header says, with palettes, few bits and transparency made components.
struct Header {
  png_uint_32 width = 0, height = 0, x_per_metre = 0, y_per_metre = 0;
  int n_components = 0, n_bits = 0;
  std::size_t row_bytes = 0;
};

/// Everything that may jump: no object with a destructor lives in these two functions.
bool read_header(Png& p, Header& header) {
  if (setjmp(png_jmpbuf(p.png))) return false;
  png_init_io(p.png, p.file);
  png_read_info(p.png, p.info);
  png_set_expand(p.png);
  if (png_get_bit_depth(p.png, p.info) == 16) png_set_swap(p.png);
  png_set_interlace_handling(p.png);
  png_read_update_info(p.png, p.info);
  header.width = png_get_image_width(p.png, p.info);
  header.height = png_get_image_height(p.png, p.info);
  header.n_components = png_get_channels(p.png, p.info);
  header.n_bits = png_get_bit_depth(p.png, p.info);
  header.row_bytes = png_get_rowbytes(p.png, p.info);
  header.x_per_metre = png_get_x_pixels_per_meter(p.png, p.info);
  header.y_per_metre = png_get_y_pixels_per_meter(p.png, p.info);
  return true;
}

bool read_rows(Png& p, png_bytep* rows) {
  if (setjmp(png_jmpbuf(p.png))) return false;
  png_read_image(p.png, rows);
  png_read_end(p.png, p.info);
  return true;
}

void open(Png& p, const std::string& path) {
  p.file = std::fopen(path.c_str(), "rb");
  if (!p.file) throw InputError(path + ": cannot be read: " + std::strerror(errno));
  p.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &p, remember_error, ignore_warning);
  if (p.png) p.info = png_create_info_struct(p.png);
  if (!p.info) throw std::bad_alloc();
}

int orientation_of(const Png& p) {
  png_uint_32 n = 0;
  png_bytep exif = nullptr;
  if (png_get_eXIf_1(p.png, p.info, &n, &exif) == 0) return 1;
  return orientation_of_exif({reinterpret_cast<const char*>(exif), n});
}

template <class T>
std::vector<float> to_floats(const std::vector<unsigned char>& bytes) {
  std::vector<float> out(bytes.size() / sizeof(T));
  for (std::size_t at = 0; at < out.size(); ++at) {
    T value;
    std::memcpy(&value, bytes.data() + at * sizeof(T), sizeof(T));
    out[at] = static_cast<float>(value);
  }
  return out;
}

}  // namespace

Raster read_png(const std::string& path) {
  Png p;
  open(p, path);
  Header header;
  if (!read_header(p, header)) throw damaged(path, "PNG", p.message);
  check_image_size({header.width, header.height}, path);
  check_promised(path, "PNG", double(header.row_bytes) * header.height / 8);  // of a bit each
  std::vector<unsigned char> bytes(header.row_bytes * header.height);
  std::vector<png_bytep> rows;
  for (std::size_t j = 0; j < header.height; ++j) rows.push_back(&bytes[j * header.row_bytes]);
  if (!read_rows(p, rows.data())) throw damaged(path, "PNG", p.message);
  Raster out;
  out.size = {int(header.width), int(header.height)};
  out.n_components = header.n_components;
  out.scalar_type = header.n_bits == 16 ? "uint16" : "uint8";
  out.values =
      header.n_bits == 16 ? to_floats<std::uint16_t>(bytes) : to_floats<unsigned char>(bytes);
  if (header.x_per_metre > 0 && header.y_per_metre > 0)
    out.spacing_mm = Eigen::Vector2d(1000.0 / header.x_per_metre, 1000.0 / header.y_per_metre);
  out.orientation = orientation_of(p);
  turn_upright(out);
  return out;
}

}  // namespace surf::curve
