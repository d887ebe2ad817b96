#include "libsurf/volume/detail/dicom_pixels.h"

#include <fmt/format.h>
#include <gdcmImageReader.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <new>
#include <optional>
#include <utility>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

// More than read-ahead of 8 were never tried; each holds a file's pixels, as floats at most.
constexpr std::size_t kMostChildren = 8, kMostBytes = std::size_t(1) << 28;

/// A file that knows whether a value ended early: GDCM reads truncated pixels without complaint.
class WatchedFile : public std::filebuf {
 public:
  bool is_short = false;

 protected:
  std::streamsize xsgetn(char* out, std::streamsize n_wanted) override {
    // The end of a file is found by looking for one more element's tag, length and so on.
    constexpr std::streamsize kLongestField = 8;
    const std::streamsize n = std::filebuf::xsgetn(out, n_wanted);
    is_short |= n < n_wanted && (n > 0 || n_wanted > kLongestField);
    return n;
  }
};

std::optional<ScalarType> scalar_type(const gdcm::PixelFormat& format) {
  switch (format.GetScalarType()) {
    case gdcm::PixelFormat::UINT8:
      return ScalarType::kUint8;
    case gdcm::PixelFormat::INT8:
      return ScalarType::kInt8;
    case gdcm::PixelFormat::UINT12:
    case gdcm::PixelFormat::UINT16:
      return ScalarType::kUint16;
    case gdcm::PixelFormat::INT12:
    case gdcm::PixelFormat::INT16:
      return ScalarType::kInt16;
    case gdcm::PixelFormat::UINT32:
      return ScalarType::kUint32;
    case gdcm::PixelFormat::INT32:
      return ScalarType::kInt32;
    case gdcm::PixelFormat::FLOAT32:
      return ScalarType::kFloat32;
    case gdcm::PixelFormat::FLOAT64:
      return ScalarType::kFloat64;
    default:
      return std::nullopt;
  }
}

// Both ends of the channel. A question is the numbers and the file's name, an answer this and the
// pixels, or the name of a type that is no scalar, or nothing.
struct Question {
  std::uint64_t n_pixels, n_frames, n_name;
};
enum class Kind : std::uint8_t { kPixels, kOtherType, kUnreadable, kNoMemory };
struct Answer {
  Kind kind;
  ScalarType type;
  std::uint64_t n_bytes;
};

struct Decoded {
  Answer answer = {Kind::kUnreadable, ScalarType::kUint8, 0};
  std::string bytes;
};

Decoded decode(const std::string& file, const Question& question) {
  WatchedFile buffer;
  buffer.open(file, std::ios::in | std::ios::binary);
  std::istream stream(&buffer);
  gdcm::ImageReader reader;
  reader.SetStream(stream);
  if (!reader.Read() || buffer.is_short) return {};
  const gdcm::Image& image = reader.GetImage();
  if (image.GetPixelFormat().GetSamplesPerPixel() != 1) return {};
  const std::optional<ScalarType> type = scalar_type(image.GetPixelFormat());
  if (!type) {
    const std::string name = image.GetPixelFormat().GetScalarTypeAsString();
    return {{Kind::kOtherType, {}, name.size()}, name};
  }
  const unsigned* dimensions = image.GetDimensions();
  const std::size_t n_frames = image.GetNumberOfDimensions() > 2 ? dimensions[2] : 1;
  const std::size_t n_bytes = n_frames * question.n_pixels * volume::n_bytes(*type);
  if (std::uint64_t(dimensions[0]) * dimensions[1] != question.n_pixels ||
      n_frames < question.n_frames || image.GetBufferLength() != n_bytes)
    return {};
  std::string pixels(n_bytes, '\0');
  if (!image.GetBuffer(pixels.data())) return {};
  pixels.resize(question.n_frames * question.n_pixels * volume::n_bytes(*type));
  return {{Kind::kPixels, *type, pixels.size()}, std::move(pixels)};
}

/// Far more than any decoder takes, JPEG 2000 by 10 MB/s included: one that finds no end in damaged
/// pixels is ended.
unsigned most_seconds(const Question& question) {
  constexpr std::uint64_t kLeast = 60, kPixelsPerSecond = 200'000, kMost = 1'000'000;
  return unsigned(
      std::min(kMost, kLeast + question.n_pixels * question.n_frames / kPixelsPerSecond));
}

/// The child's work: answers questions until none comes.
void answer_all(Channel& channel) {
  Question question;
  while (channel.receive(question)) {
    std::string file(question.n_name, '\0');
    if (!channel.receive(file.data(), file.size())) return;
    limit_cpu_seconds(most_seconds(question));
    Decoded decoded;
    try {
      decoded = decode(file, question);
    } catch (const std::bad_alloc&) {
      decoded.answer.kind = Kind::kNoMemory;
    }
    if (!channel.send(decoded.answer) || !channel.send(decoded.bytes.data(), decoded.bytes.size()))
      return;
  }
}

[[noreturn]] void fail(const std::string& file) {
  throw InputError(fmt::format(
      "{}: its pixels cannot be read: truncated, damaged or in an unknown transfer syntax; get "
      "the file again",
      file));
}

}  // namespace

DicomPixels::DicomPixels(std::vector<DicomFrames> files) : files_(std::move(files)) {
  const std::size_t n_threads =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  std::size_t largest = 1;
  for (const DicomFrames& file : files_)
    largest = std::max(largest, file.n_frames * file.n_pixels * sizeof(float));
  const std::size_t n_children =
      std::min({n_threads, kMostChildren, 1 + kMostBytes / largest, files_.size()});
  for (std::size_t k = 0; k < n_children; ++k)
    children_.push_back(std::make_unique<ChildProcess>(answer_all));
  for (std::size_t file = 0; file < n_children; ++file) ask(file);
}

void DicomPixels::ask(std::size_t file) {
  const DicomFrames& frames = files_[file];
  const Question question = {frames.n_pixels, frames.n_frames, frames.file.size()};
  // A child that has ended is met where its answer is read, in the order of the files.
  Channel& channel = child_of(file).channel();
  if (channel.send(question)) channel.send(frames.file.data(), frames.file.size());
}

ScalarType DicomPixels::load_next() {
  const DicomFrames& frames = files_[n_loaded_];
  ChildProcess& child = child_of(n_loaded_);
  Answer answer;
  if (!child.channel().receive(answer)) {
    if (child.was_killed()) throw std::bad_alloc();
    fail(frames.file);
  }
  if (answer.kind == Kind::kUnreadable) fail(frames.file);
  if (answer.kind == Kind::kNoMemory) throw std::bad_alloc();
  if (answer.kind == Kind::kOtherType) {
    std::string name(std::min<std::size_t>(answer.n_bytes, 100), '\0');
    child.channel().receive(name.data(), name.size());
    throw InputError(
        fmt::format("{}: pixels of type {} are not scalars surfseg reads", frames.file, name));
  }
  n_frame_bytes_ = frames.n_pixels * n_bytes(answer.type);
  if (answer.n_bytes != frames.n_frames * n_frame_bytes_) fail(frames.file);
  pixels_.resize(answer.n_bytes);
  if (!child.channel().receive(pixels_.data(), pixels_.size())) fail(frames.file);
  if (const std::size_t next = n_loaded_ + children_.size(); next < files_.size()) ask(next);
  ++n_loaded_;
  return answer.type;
}

const std::byte* DicomPixels::frame(int frame) const {
  if (pixels_.size() < (std::size_t(frame) + 1) * n_frame_bytes_) fail(files_[n_loaded_ - 1].file);
  return pixels_.data() + std::size_t(frame) * n_frame_bytes_;
}

}  // namespace surf::volume
