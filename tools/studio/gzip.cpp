#include "tools/studio/gzip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "libsurf/base/error.h"

namespace surfseg::studio {
namespace {

constexpr int kGzip = 15 + 16;  // zlib's window bits for a gzip header
constexpr std::size_t kMostAtOnce = 1 << 30;

Bytef* bytes_of(const void* data) { return static_cast<Bytef*>(const_cast<void*>(data)); }

}  // namespace

struct Gzip::Stream : z_stream {};

Gzip::Gzip() : stream_(new Stream{}) {
  if (deflateInit2(stream_, 1, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
    delete stream_;
    throw surf::OutputError("zlib cannot begin to compress");
  }
}

Gzip::~Gzip() {
  deflateEnd(stream_);
  delete stream_;
}

void Gzip::add(const void* data, std::size_t n) {
  for (std::size_t at = 0; at < n; at += kMostAtOnce)
    run(static_cast<const char*>(data) + at, std::min(kMostAtOnce, n - at), Z_NO_FLUSH);
}

std::string Gzip::finish() {
  run(nullptr, 0, Z_FINISH);
  return std::move(out_);
}

void Gzip::run(const void* data, std::size_t n, int flush) {
  stream_->next_in = bytes_of(data);
  stream_->avail_in = uInt(n);
  char buffer[1 << 16];
  do {
    stream_->next_out = bytes_of(buffer);
    stream_->avail_out = sizeof buffer;
    deflate(stream_, flush);
    out_.append(buffer, sizeof buffer - stream_->avail_out);
  } while (stream_->avail_out == 0);
}

std::string gunzip(const std::string& bytes, std::size_t n) {
  z_stream stream = {};
  if (inflateInit2(&stream, kGzip) != Z_OK) throw surf::InputError("zlib cannot begin to inflate");
  std::string out;
  stream.next_in = bytes_of(bytes.data());
  std::size_t left = bytes.size();
  char buffer[1 << 16];
  int status = Z_OK;
  // Memory grows with what really comes out, whatever was announced.
  while (status == Z_OK && out.size() <= n) {
    if (stream.avail_in == 0) {
      stream.avail_in = uInt(std::min(left, kMostAtOnce));
      left -= stream.avail_in;
    }
    stream.next_out = bytes_of(buffer);
    stream.avail_out = sizeof buffer;
    status = inflate(&stream, Z_NO_FLUSH);
    out.append(buffer, sizeof buffer - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END || out.size() != n)
    throw surf::InputError(
        fmt::format("the data are no gzip of {} bytes: {} come out", n, out.size()));
  return out;
}

}  // namespace surfseg::studio
