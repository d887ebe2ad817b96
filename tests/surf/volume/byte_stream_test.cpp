#include "libsurf/volume/detail/byte_stream.h"

#include <zlib.h>

#include <cstdint>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

using Encoding = ByteStream::Encoding;

/// 100,000 bytes that deflate shrinks to a few thousand.
std::string some_bytes() {
  std::string out;
  for (int n = 0; n < 100000; ++n) out += char(std::int64_t(n) * n / 100);
  return out;
}

/// @param window_bits  15: zlib, 31: gzip
std::string deflated(const std::string& bytes, int window_bits) {
  z_stream stream = {};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

class ByteStreams : public Files {
 protected:
  static std::string read_all(ByteStream& stream, std::size_t n, std::size_t piece) {
    std::string out(n, '\0');
    for (std::size_t at = 0; at < n; at += piece)
      stream.read(out.data() + at, std::min(piece, n - at));
    return out;
  }
};

TEST_F(ByteStreams, GiveTheSameBytesHoweverTheyArePacked) {
  const std::string bytes = some_bytes();
  const struct {
    std::string packed;
    Encoding encoding;
    bool is_compressed;
  } files[] = {{bytes, Encoding::kRaw, false},
               {bytes, Encoding::kDetect, false},
               {deflated(bytes, 31), Encoding::kDetect, true},
               {deflated(bytes, 31), Encoding::kDeflate, true},
               {deflated(bytes, 15), Encoding::kDeflate, true}};
  for (const auto& file : files)
    for (const std::size_t piece : {std::size_t(777), bytes.size()}) {
      ByteStream stream(write("bytes", "header" + file.packed), 6, file.encoding);
      EXPECT_EQ(stream.is_compressed(), file.is_compressed);
      EXPECT_EQ(read_all(stream, bytes.size(), piece), bytes);
      EXPECT_NO_THROW(stream.verify_end());
    }
}

TEST_F(ByteStreams, SkipAndReadOn) {
  const std::string bytes = some_bytes();
  for (const std::string& packed : {bytes, deflated(bytes, 31)}) {
    ByteStream stream(write("bytes", packed), 0, Encoding::kDetect);
    stream.skip(70001);
    EXPECT_EQ(read_all(stream, 100, 100), bytes.substr(70001, 100));
  }
}

TEST_F(ByteStreams, ReadSomeEndsWhereTheBytesDo) {
  const std::string bytes = some_bytes();
  for (const std::string& packed : {bytes, deflated(bytes, 31)}) {
    ByteStream stream(write("bytes", packed), 0, Encoding::kDetect);
    std::string out(bytes.size() + 50, '\0');
    EXPECT_EQ(stream.read_some(out.data(), out.size()), bytes.size());
    out.resize(bytes.size());
    EXPECT_EQ(out, bytes);
    EXPECT_THROW(stream.read(out.data(), 1), InputError);
  }
}

TEST_F(ByteStreams, SayAheadThatAFileIsTooShort) {
  const std::string bytes = some_bytes();
  ByteStream raw(write("raw", bytes), 10, Encoding::kRaw);
  EXPECT_NO_THROW(raw.require(bytes.size() - 10));
  EXPECT_THROW(raw.require(bytes.size() - 9), InputError);
  const std::string packed = deflated(bytes, 31);
  ByteStream gzip(write("gzip", packed), 0, Encoding::kDetect);
  EXPECT_NO_THROW(gzip.require(bytes.size()));
  EXPECT_THROW(gzip.require(1100 * packed.size()), InputError);  // more than deflate can hold
}

TEST_F(ByteStreams, RefuseWhatIsCutOffOrDamaged) {
  const std::string bytes = some_bytes(), packed = deflated(bytes, 31);
  ByteStream cut(write("cut", packed.substr(0, packed.size() / 2)), 0, Encoding::kDetect);
  EXPECT_THROW(read_all(cut, bytes.size(), 1000), InputError);
  // The checksum: all bytes come, and the end tells.
  std::string wrong = packed;
  wrong[wrong.size() - 6] ^= 1;
  ByteStream damaged(write("damaged", wrong), 0, Encoding::kDetect);
  EXPECT_THROW(
      {
        read_all(damaged, bytes.size(), 1000);
        damaged.verify_end();
      },
      InputError);
}

TEST_F(ByteStreams, RefuseWhatIsNoFile) {
  EXPECT_THROW(ByteStream(path("missing"), 0, Encoding::kRaw), InputError);
  EXPECT_THROW(ByteStream(path("."), 0, Encoding::kRaw), InputError);
  EXPECT_THROW(ByteStream(write("short", "abc"), 4, Encoding::kRaw), InputError);
  try {
    ByteStream(path("missing"), 0, Encoding::kRaw);
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(path("missing")), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace surf::volume
