// Bytes of a .vdb file and the pieces that they are made of, none believed before it is checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "libsurf/volume/detail/byte_stream.h"

namespace surf::volume {

/// How values are packed, as the file says it for each grid: a sum of these.
enum VdbCompression : std::uint32_t { kZip = 1, kActiveValuesOnly = 2, kBlosc = 4 };

/// Reads forward from a place of the file. All numbers are little endian.
class VdbStream {
 public:
  /// @throws InputError  as ByteStream
  VdbStream(const std::string& path, std::uint64_t offset);

  /// @throws InputError  truncated; so do all that follow
  void read(void* out, std::size_t n_bytes) { bytes_.read(out, n_bytes); }
  void skip(std::uint64_t n_bytes) { bytes_.skip(n_bytes); }
  template <class T>
  T number() {
    T out;
    read(&out, sizeof out);
    return out;
  }
  /// @throws InputError  longer than any name is
  std::string text();
  /// `n_bytes` of values, packed by zip, Blosc or not at all.
  /// @throws InputError  the packed bytes are damaged, or more than packing makes of so many
  void unpack(void* out, std::size_t n_bytes, std::uint32_t compression);

  /// @throws InputError  "path: not a readable OpenVDB file: what; get the file again"
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  std::string path_;
  ByteStream bytes_;
  std::vector<unsigned char> packed_;
};

}  // namespace surf::volume
