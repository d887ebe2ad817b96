// gzip in memory.
#pragma once

#include <cstddef>
#include <string>

namespace surfseg::studio {

/// Fast rather than small: what goes no further than this machine.
class Gzip {
 public:
  Gzip();
  ~Gzip();
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;

  void add(const void* data, std::size_t n);
  std::string finish();

 private:
  struct Stream;
  void run(const void* data, std::size_t n, int flush);

  Stream* stream_;
  std::string out_;
};

/// @param n  bytes that come out
/// @throws surf::InputError  it is no gzip, or others come out
std::string gunzip(const std::string& bytes, std::size_t n);

}  // namespace surfseg::studio
