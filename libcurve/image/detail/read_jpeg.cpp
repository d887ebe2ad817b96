#include <turbojpeg.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

#include "libcurve/image/detail/raster.h"

namespace surf::curve {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  std::string content(std::size_t(std::max<std::streamoff>(stream.tellg(), 0)), '\0');
  stream.seekg(0);
  if (!stream.read(content.data(), std::streamsize(content.size())))
    throw InputError(path + ": cannot be read: " + std::strerror(errno));
  return content;
}

/// libjpeg fills what is missing with grey; only the end's mark tells.
void check_end(const std::string& content, const std::string& path) {
  constexpr std::size_t kTail = 4096;  // some cameras append a few bytes
  const std::size_t at = content.rfind("\xff\xd9");
  if (at == std::string::npos || content.size() - at > kTail)
    throw damaged(path, "JPEG", "its end is missing");
}

}  // namespace

Raster read_jpeg(const std::string& path) {
  const std::string content = content_of(path);
  check_end(content, path);
  const auto* bytes = reinterpret_cast<const unsigned char*>(content.data());
  const std::unique_ptr<void, int (*)(tjhandle)> reader(tjInitDecompress(), tjDestroy);
  if (!reader) throw std::bad_alloc();
  Raster out;
  int subsampling = 0, colours = 0;
  if (tjDecompressHeader3(reader.get(), bytes, content.size(), &out.size[0], &out.size[1],
                          &subsampling, &colours) != 0)
    throw damaged(path, "JPEG", tjGetErrorStr2(reader.get()));
  if (colours == TJCS_CMYK || colours == TJCS_YCCK)
    throw InputError(path + ": a JPEG of four printing colours (CMYK); save it in grey or RGB");
  out.n_components = colours == TJCS_GRAY ? 1 : 3;
  out.scalar_type = "uint8";
  check_image_size({out.size[0], out.size[1]}, path);
  const std::size_t n_values = std::size_t(out.size[0]) * out.size[1] * out.n_components;
  check_promised(path, "JPEG", double(n_values));
  std::vector<unsigned char> values(n_values);
  const int status = tjDecompress2(reader.get(), bytes, content.size(), values.data(), out.size[0],
                                   0, out.size[1], colours == TJCS_GRAY ? TJPF_GRAY : TJPF_RGB,
                                   TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS);
  if (status != 0 && tjGetErrorCode(reader.get()) == TJERR_FATAL)
    throw damaged(path, "JPEG", tjGetErrorStr2(reader.get()));
  out.values.assign(values.begin(), values.end());
  return out;
}

}  // namespace surf::curve
