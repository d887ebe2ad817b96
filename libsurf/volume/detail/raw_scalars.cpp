#include "libsurf/volume/detail/raw_scalars.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <tuple>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

template <class T>
void convert_as(bool swap, const std::byte* stored, std::size_t stride, double slope,
                double intercept, float* out, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n) {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), stored + n * stride * sizeof(T), sizeof(T));
    if (swap) std::reverse(bytes.begin(), bytes.end());
    out[n] = static_cast<float>(slope * static_cast<double>(std::bit_cast<T>(bytes)) + intercept);
  }
}

/// In the order of ScalarType.
using CppTypes = std::tuple<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                            std::uint32_t, std::int64_t, std::uint64_t, float, double>;

/// Calls f with a value of the C++ type.
template <std::size_t First = 0, class F>
auto visit(ScalarType type, const F& f) {
  if constexpr (First + 1 < std::tuple_size_v<CppTypes>)
    if (static_cast<std::size_t>(type) != First) return visit<First + 1>(type, f);
  return f(std::tuple_element_t<First, CppTypes>());
}

}  // namespace

std::optional<ScalarType> find_scalar_type(ScalarKind kind, std::size_t n_bytes) {
  if (kind == ScalarKind::kFloat) {
    if (n_bytes == 4) return ScalarType::kFloat32;
    if (n_bytes == 8) return ScalarType::kFloat64;
    return std::nullopt;
  }
  if (!std::has_single_bit(n_bytes) || n_bytes > 8) return std::nullopt;
  // Signed and unsigned ones take turns, from the shortest to the longest.
  const int place = 2 * std::countr_zero(n_bytes) + (kind == ScalarKind::kUnsigned);
  return static_cast<ScalarType>(place);
}

std::size_t n_bytes(ScalarType type) {
  return visit(type, [](auto value) { return sizeof value; });
}

const char* name(ScalarType type) {
  constexpr std::array<const char*, 10> kNames = {"int8",    "uint8",  "int16", "uint16",
                                                  "int32",   "uint32", "int64", "uint64",
                                                  "float32", "float64"};
  return kNames[static_cast<std::size_t>(type)];
}

void convert(ScalarType type, bool swap, const std::byte* stored, std::size_t stride, double slope,
             double intercept, float* out, std::size_t count) {
  visit(type, [&](auto value) {
    convert_as<decltype(value)>(swap, stored, stride, slope, intercept, out, count);
  });
}

void check_frame(const std::string& path, int frame, std::int64_t n_frames) {
  if (frame >= 0 && frame < n_frames) return;
  throw InputError(fmt::format("{}: has {} frame{}, no frame {}; frames count from 0", path,
                               n_frames, n_frames == 1 ? "" : "s", frame));
}

std::array<int, 3> checked_size(const std::string& path, const std::array<std::int64_t, 3>& size) {
  for (const std::int64_t n : size)
    if (n < 1 || n > std::numeric_limits<int>::max())
      throw InputError(
          fmt::format("{}: the header gives {} x {} x {} voxels; each must be from 2 to {}", path,
                      size[0], size[1], size[2], std::numeric_limits<int>::max()));
  return {static_cast<int>(size[0]), static_cast<int>(size[1]), static_cast<int>(size[2])};
}

Volume read_raw(ByteStream& stream, const RawLayout& layout, const Eigen::Matrix4d& index_to_world,
                Source source) {
  check_frame(source.path, layout.frame, layout.n_frames);
  source.scalar_type = name(layout.type);
  source.n_frames = layout.n_frames;
  source.frame = layout.frame;
  const std::size_t stride = layout.has_frames_fastest ? layout.n_frames : 1;
  const std::size_t n_values = std::size_t(layout.size[0]) * layout.size[1];
  const std::size_t scalar = n_bytes(layout.type);

  // In double first: the product of four sizes from a hostile header overflows 64 bits.
  const double n_all_bytes = static_cast<double>(n_values) * layout.size[2] * scalar *
                             static_cast<double>(layout.n_frames);
  if (n_all_bytes > 0x1p62)
    throw InputError(fmt::format("{}: the header promises {:.1e} bytes of voxels; it is broken",
                                 source.path, n_all_bytes));
  Volume::Builder builder(layout.size, index_to_world, std::move(source));
  const std::uint64_t n_frame_bytes = std::uint64_t(n_values) * layout.size[2] * scalar;
  stream.require(n_frame_bytes * layout.n_frames);
  if (!layout.has_frames_fastest) stream.skip(n_frame_bytes * layout.frame);

  const bool swap = layout.is_big_endian != (std::endian::native == std::endian::big);
  std::vector<std::byte> stored(n_values * stride * scalar);
  std::vector<float> slice(n_values);
  const std::byte* first = stored.data() + (layout.has_frames_fastest ? layout.frame * scalar : 0);
  for (int k = 0; k < layout.size[2]; ++k) {
    stream.read(stored.data(), stored.size());
    convert(layout.type, swap, first, stride, layout.slope, layout.intercept, slice.data(),
            slice.size());
    builder.append_slice(slice);
  }
  stream.verify_end();
  return builder.finish();
}

}  // namespace surf::volume
