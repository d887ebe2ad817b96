// Bytes of a file from some place on, inflated on the way if they are compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace surf::volume {

/// Reads forward only, in small pieces, so that no second copy of a volume is ever held.
/// Every failure is an InputError that names the file.
class ByteStream {
 public:
  enum class Encoding {
    kRaw,
    kDeflate,  ///< zlib or gzip, whichever the bytes are
    kDetect    ///< gzip if the bytes begin as such, else raw
  };

  /// @throws InputError  the file is missing, a folder, unreadable or shorter than `offset`
  ByteStream(const std::string& path, std::uint64_t offset, Encoding encoding);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// Checks, before anything is allocated, that n_bytes more can come at all: deflate shrinks
  /// by no more than 1032.
  /// @throws InputError  the file is truncated
  void require(std::uint64_t n_bytes) const;

  /// Fills `out` with as much as there is, up to n_bytes; returns how much came.
  /// @throws InputError  damaged compressed data
  std::size_t read_some(void* out, std::size_t n_bytes);

  /// @throws InputError  truncated or damaged, with the place
  void read(void* out, std::size_t n_bytes);
  void skip(std::uint64_t n_bytes);

  /// Reads to the end of the compressed data, so that its checksum is verified; nothing if raw.
  /// @throws InputError
  void verify_end();

  bool is_compressed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
