// What is fuzzed: every reader of files that come from outside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace surf::fuzz {

struct Target {
  const char* name;  ///< also of its folder in corpus/ and regressions/
  const char* file;  ///< the name under which the reader sees the bytes: endings matter
  /// Reads the file.
  /// @throws surf::Error  it is broken; anything else is a finding
  void (*read)(const std::string& path);
  /// Bytes of memory that a byte of the file may honestly ask for: 4 times what it can declare.
  double most_per_byte;
};

std::span<const Target> targets();
/// @throws std::invalid_argument  there is none of this name
const Target& target(const std::string& name);

/// How a file was taken.
struct Reading {
  bool is_read = false;  ///< else refused, with `message`
  std::string message;
  std::size_t peak_bytes = 0;  ///< of the heap, beyond what was in use before
};

/// Bytes that any file may ask for: buffers, and what libraries keep of their own.
inline constexpr std::size_t kFreeBytes = std::size_t(48) << 20;

/// Runs the reader on these bytes, from a file in a folder of its own.
/// @throws std::logic_error  more memory than allowed, a message of several lines; and whatever the
///                           reader throws that is no surf::Error
Reading run(const Target& target, std::span<const std::uint8_t> bytes);

}  // namespace surf::fuzz
