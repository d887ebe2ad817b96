#include "libsurf/io/detail/jpeg_file.h"

#include <fmt/format.h>

#include <csetjmp>
#include <cstdlib>

// jpeglib.h names FILE, which <cstdio> has.
// clang-format off
#include <cstdio>
#include <jpeglib.h>
// clang-format on

#include "libsurf/base/error.h"

namespace surf::io {
namespace {

struct Jpeg {
  jpeg_compress_struct info = {};
  jpeg_error_mgr errors = {};
  std::jmp_buf failure;
  unsigned char* bytes = nullptr;
  unsigned long n_bytes = 0;

  Jpeg() {
    info.err = jpeg_std_error(&errors);
    info.client_data = this;
    errors.error_exit = [](j_common_ptr any) {
      std::longjmp(static_cast<Jpeg*>(any->client_data)->failure, 1);
    };
    errors.emit_message = [](j_common_ptr, int) {};
  }
  ~Jpeg() {
    jpeg_destroy_compress(&info);
    std::free(bytes);
  }
  Jpeg(const Jpeg&) = delete;
  Jpeg& operator=(const Jpeg&) = delete;
};

/// May jump: no object with a destructor lives here.
bool write(Jpeg& jpeg, int width, int height, const std::uint8_t* pixels, int quality) {
  if (setjmp(jpeg.failure)) return false;
  jpeg_create_compress(&jpeg.info);
  jpeg_mem_dest(&jpeg.info, &jpeg.bytes, &jpeg.n_bytes);
  jpeg.info.image_width = JDIMENSION(width);
  jpeg.info.image_height = JDIMENSION(height);
  jpeg.info.input_components = 3;
  jpeg.info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg.info);
  jpeg_set_quality(&jpeg.info, quality, /*force_baseline=*/TRUE);
  jpeg_start_compress(&jpeg.info, TRUE);
  while (jpeg.info.next_scanline < jpeg.info.image_height) {
    // libjpeg reads the row alone, whatever its type says.
    auto* row = const_cast<JSAMPLE*>(pixels + std::size_t(3) * width * jpeg.info.next_scanline);
    jpeg_write_scanlines(&jpeg.info, &row, 1);
  }
  jpeg_finish_compress(&jpeg.info);
  return true;
}

}  // namespace

std::string jpeg_bytes(int width, int height, const std::uint8_t* pixels, int quality) {
  Jpeg jpeg;
  if (!write(jpeg, width, height, pixels, quality)) {
    char reason[JMSG_LENGTH_MAX];
    jpeg.errors.format_message(reinterpret_cast<j_common_ptr>(&jpeg.info), reason);
    throw OutputError(
        fmt::format("a JPEG of {} x {} pixels cannot be made: {}", width, height, reason));
  }
  return {reinterpret_cast<const char*>(jpeg.bytes), jpeg.n_bytes};
}

}  // namespace surf::io
