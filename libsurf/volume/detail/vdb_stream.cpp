#include "libsurf/volume/detail/vdb_stream.h"

#include <blosc.h>
#include <fmt/format.h>
#include <zlib.h>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

constexpr std::uint32_t kLongestText = 1 << 16;

bool inflate_block(const std::vector<unsigned char>& packed, void* out, std::size_t n_bytes) {
  uLongf n_out = n_bytes;
  return uncompress(static_cast<Bytef*>(out), &n_out, packed.data(), packed.size()) == Z_OK &&
         n_out == n_bytes;
}

/// In this thread, without Blosc's global state.
bool unpack_blosc(const std::vector<unsigned char>& packed, void* out, std::size_t n_bytes) {
  std::size_t n_out = 0;
  return blosc_cbuffer_validate(packed.data(), packed.size(), &n_out) == 0 && n_out == n_bytes &&
         blosc_decompress_ctx(packed.data(), out, n_bytes, /*numinternalthreads=*/1) ==
             int(n_bytes);
}

}  // namespace

VdbStream::VdbStream(const std::string& path, std::uint64_t offset)
    : path_(path), bytes_(path, offset, ByteStream::Encoding::kRaw) {}

std::string VdbStream::text() {
  const auto n = number<std::uint32_t>();
  if (n > kLongestText) refuse(fmt::format("a name of {} characters", n));
  std::string out(n, '\0');
  read(out.data(), n);
  return out;
}

void VdbStream::unpack(void* out, std::size_t n_bytes, std::uint32_t compression) {
  if (!(compression & (kZip | kBlosc))) return read(out, n_bytes);
  const auto n_packed = number<std::int64_t>();
  if (n_packed == -std::int64_t(n_bytes)) return read(out, n_bytes);  // packing did not help
  if (n_packed <= 0 || n_packed > std::int64_t(n_bytes + BLOSC_MAX_OVERHEAD))
    refuse(fmt::format("{} bytes of values are packed into {}", n_bytes, n_packed));
  packed_.resize(std::size_t(n_packed));
  read(packed_.data(), packed_.size());
  const bool is_whole =
      n_bytes == 0 || (compression & kBlosc ? unpack_blosc(packed_, out, n_bytes)
                                            : inflate_block(packed_, out, n_bytes));
  if (!is_whole) refuse("damaged compressed data");
}

void VdbStream::refuse(const std::string& what) const {
  throw InputError(
      fmt::format("{}: not a readable OpenVDB file: {}; get the file again", path_, what));
}

}  // namespace surf::volume
