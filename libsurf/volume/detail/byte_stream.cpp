#include "libsurf/volume/detail/byte_stream.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

constexpr std::size_t kChunk = std::size_t(1) << 16;
constexpr std::uint64_t kLargestRatio = 1032;  // of deflate, see zlib's technical notes
constexpr int kZlibOrGzip = 32 + MAX_WBITS;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

struct ByteStream::Impl {
  std::string path;
  std::unique_ptr<std::FILE, CloseFile> file;
  std::uint64_t n_left = 0;  ///< bytes of the file not yet read (as stored)
  std::uint64_t n_out = 0;   ///< bytes handed out
  bool is_compressed = false, is_gzip = false, is_at_end = false;
  z_stream inflater = {};
  std::array<unsigned char, kChunk> chunk;

  ~Impl() {
    if (is_compressed) inflateEnd(&inflater);
  }

  std::size_t read_stored(void* out, std::size_t n_bytes) {
    const std::size_t n = std::fread(out, 1, n_bytes, file.get());
    if (n < n_bytes && std::ferror(file.get()))
      throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
    n_left -= std::min<std::uint64_t>(n, n_left);
    return n;
  }

  bool refill() {
    if (inflater.avail_in > 0) return true;
    inflater.avail_in = static_cast<unsigned>(read_stored(chunk.data(), chunk.size()));
    inflater.next_in = chunk.data();
    return inflater.avail_in > 0;
  }

  void start_inflating() {
    is_compressed = true;
    if (inflateInit2(&inflater, kZlibOrGzip) != Z_OK) throw std::bad_alloc();
    if (refill()) is_gzip = chunk[0] == 0x1f;
  }

  /// gzip files may be several streams one after the other.
  void next_member() {
    if (is_gzip && refill() && *inflater.next_in == 0x1f)
      inflateReset(&inflater);
    else
      is_at_end = true;
  }

  std::size_t inflate_some(void* out, std::size_t n_bytes) {
    constexpr std::size_t kLargest = std::size_t(1) << 30;
    inflater.next_out = static_cast<Bytef*>(out);
    std::size_t n_done = 0;
    while (n_done < n_bytes && !is_at_end && refill()) {
      const std::size_t n_wanted = std::min(n_bytes - n_done, kLargest);
      inflater.avail_out = static_cast<unsigned>(n_wanted);
      const int status = inflate(&inflater, Z_NO_FLUSH);
      n_done += n_wanted - inflater.avail_out;
      if (status == Z_STREAM_END)
        next_member();
      else if (status != Z_OK)
        throw InputError(fmt::format(
            "{}: damaged compressed data {} bytes into the inflated file; get the file again", path,
            n_out + n_done));
    }
    return n_done;
  }
};

ByteStream::ByteStream(const std::string& path, std::uint64_t offset, Encoding encoding)
    : impl_(std::make_unique_for_overwrite<Impl>()) {
  impl_->path = path;
  std::error_code status;
  if (std::filesystem::is_directory(path, status))
    throw InputError(fmt::format("{}: is a folder; give a file", path));
  impl_->file.reset(std::fopen(path.c_str(), "rb"));
  if (!impl_->file)
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  const std::uint64_t n_bytes = std::filesystem::file_size(path, status);
  if (status) throw InputError(fmt::format("{}: cannot be read: {}", path, status.message()));
  if (offset > n_bytes)
    throw InputError(fmt::format("{}: truncated: the data should begin at byte {}, the file has {}",
                                 path, offset, n_bytes));
  unsigned char magic[2] = {};
  std::fseek(impl_->file.get(), static_cast<long>(offset), SEEK_SET);
  if (encoding == Encoding::kDetect && std::fread(magic, 1, 2, impl_->file.get()) == 2 &&
      magic[0] == 0x1f && magic[1] == 0x8b)
    encoding = Encoding::kDeflate;
  std::fseek(impl_->file.get(), static_cast<long>(offset), SEEK_SET);
  impl_->n_left = n_bytes - offset;
  if (encoding == Encoding::kDeflate) impl_->start_inflating();
}

ByteStream::~ByteStream() = default;

bool ByteStream::is_compressed() const { return impl_->is_compressed; }

void ByteStream::require(std::uint64_t n_bytes) const {
  const std::uint64_t n_stored = impl_->n_left + impl_->inflater.avail_in;
  const std::uint64_t least = is_compressed() ? n_bytes / kLargestRatio : n_bytes;
  if (n_stored < least)
    throw InputError(fmt::format(
        "{}: truncated: the header promises {} bytes of voxels, the file holds {}{}; get the file "
        "again",
        impl_->path, n_bytes, n_stored, is_compressed() ? " compressed" : ""));
}

std::size_t ByteStream::read_some(void* out, std::size_t n_bytes) {
  const std::size_t n =
      is_compressed() ? impl_->inflate_some(out, n_bytes) : impl_->read_stored(out, n_bytes);
  impl_->n_out += n;
  return n;
}

void ByteStream::read(void* out, std::size_t n_bytes) {
  if (read_some(out, n_bytes) != n_bytes)
    throw InputError(fmt::format("{}: truncated: the data end after {} bytes{}; get the file again",
                                 impl_->path, impl_->n_out, is_compressed() ? " inflated" : ""));
}

void ByteStream::skip(std::uint64_t n_bytes) {
  if (!is_compressed() && n_bytes <= impl_->n_left) {
    std::fseek(impl_->file.get(), static_cast<long>(n_bytes), SEEK_CUR);
    impl_->n_left -= n_bytes;
    impl_->n_out += n_bytes;
    return;
  }
  std::array<char, 4096> discarded;
  for (; n_bytes > 0; n_bytes -= std::min<std::uint64_t>(n_bytes, discarded.size()))
    read(discarded.data(), std::min<std::uint64_t>(n_bytes, discarded.size()));
}

void ByteStream::verify_end() {
  if (!is_compressed()) return;
  std::array<char, 4096> discarded;
  while (read_some(discarded.data(), discarded.size()) > 0) {
  }
  if (!impl_->is_at_end)
    throw InputError(fmt::format(
        "{}: truncated: the compressed data have no end; get the file again", impl_->path));
}

}  // namespace surf::volume
