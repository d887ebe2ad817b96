#include "libsurf/io/detail/zip_file.h"

#include <zlib.h>

#include <cstdint>
#include <new>

#include "libsurf/base/error.h"

namespace surf::io {
namespace {

// Of PKWARE's APPNOTE: signatures, version 2.0 for deflate, names in UTF-8.
constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr std::uint16_t kVersion = 20, kUtf8 = 1 << 11, kDeflated = 8, kFirstDay = 1 << 5 | 1;
constexpr std::size_t kMost = 0xffffffff;

void append2(std::string& bytes, std::uint16_t value) {
  bytes += char(value & 0xff);
  bytes += char(value >> 8);
}

void append4(std::string& bytes, std::size_t value) {
  append2(bytes, std::uint16_t(value));
  append2(bytes, std::uint16_t(value >> 16));
}

std::string deflated(std::string_view content) {
  if (content.size() > kMost) throw OutputError("a ZIP archive holds at most 4 GB");
  z_stream stream = {};
  constexpr int kRaw = -15, kMemory = 8;  // no zlib header; zlib's own default
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kRaw, kMemory, Z_DEFAULT_STRATEGY) !=
      Z_OK)
    throw std::bad_alloc();
  std::string out(deflateBound(&stream, content.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = uInt(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  const int status = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) throw std::bad_alloc();
  return out;
}

/// What the header before a member and its entry in the directory have in common.
std::string description(const ZipMember& member, const std::string& packed) {
  std::string out;
  append2(out, kVersion);
  append2(out, kUtf8);
  append2(out, kDeflated);
  append2(out, 0);  // time
  append2(out, kFirstDay);
  append4(out,
          crc32_z(0, reinterpret_cast<const Bytef*>(member.content.data()), member.content.size()));
  append4(out, packed.size());
  append4(out, member.content.size());
  append2(out, std::uint16_t(member.name.size()));
  append2(out, 0);  // no extra field
  return out;
}

}  // namespace

std::string zip_file(const std::vector<ZipMember>& members) {
  std::string out, directory;
  for (const ZipMember& member : members) {
    const std::string packed = deflated(member.content);
    const std::string about = description(member, packed);
    append4(directory, kCentral);
    append2(directory, kVersion);
    directory += about;
    append2(directory, 0);  // comment
    append2(directory, 0);  // disk
    append2(directory, 0);  // attributes
    append4(directory, 0);
    append4(directory, out.size());
    directory += member.name;
    append4(out, kLocal);
    out.append(about).append(member.name).append(packed);
    if (out.size() > kMost) throw OutputError("a ZIP archive holds at most 4 GB");
  }
  const std::size_t begin = out.size();
  out += directory;
  append4(out, kEnd);
  append4(out, 0);  // disks
  append2(out, std::uint16_t(members.size()));
  append2(out, std::uint16_t(members.size()));
  append4(out, directory.size());
  append4(out, begin);
  append2(out, 0);  // comment
  return out;
}

}  // namespace surf::io
