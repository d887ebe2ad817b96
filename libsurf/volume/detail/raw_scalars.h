// Scalars as files store them, and their way into a volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "libsurf/volume/detail/byte_stream.h"
#include "libsurf/volume/volume.h"

namespace surf::volume {

enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64
};

enum class ScalarKind { kSigned, kUnsigned, kFloat };
/// The type of a kind with so many bytes, if there is one.
std::optional<ScalarType> find_scalar_type(ScalarKind kind, std::size_t n_bytes);

std::size_t n_bytes(ScalarType type);
/// "int8", ..., "float64"
const char* name(ScalarType type);

/// out[n] = slope * stored[n * stride] + intercept, n < count, computed in double; `swap` turns
/// each scalar's bytes round first. `stored` needs no alignment.
void convert(ScalarType type, bool swap, const std::byte* stored, std::size_t stride, double slope,
             double intercept, float* out, std::size_t count);

/// Where the voxels of one frame lie in a stream of scalars, i fastest.
struct RawLayout {
  std::array<int, 3> size;
  ScalarType type;
  bool is_big_endian = false;
  double slope = 1, intercept = 0;
  int n_frames = 1, frame = 0;
  bool has_frames_fastest = false;  ///< else they are slowest
};

/// @throws InputError  naming the frame and how many there are
void check_frame(const std::string& path, int frame, std::int64_t n_frames);

/// Throws as Volume::Builder does if sizes from a file's header exceed int or are below 1;
/// n_frames must be their number of frames.
/// @throws InputError
std::array<int, 3> checked_size(const std::string& path, const std::array<std::int64_t, 3>& size);

/// Reads the frame from a stream that stands at the first voxel of the first frame.
/// @throws InputError  truncated, damaged, NaN or Inf, no such frame
Volume read_raw(ByteStream& stream, const RawLayout& layout, const Eigen::Matrix4d& index_to_world,
                Source source);

}  // namespace surf::volume
