#include "libsurf/volume/detail/raw_scalars.h"

#include <bit>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

constexpr std::array kTypes = {ScalarType::kInt8,   ScalarType::kUint8,  ScalarType::kInt16,
                               ScalarType::kUint16, ScalarType::kInt32,  ScalarType::kUint32,
                               ScalarType::kInt64,  ScalarType::kUint64, ScalarType::kFloat32,
                               ScalarType::kFloat64};

template <class T>
std::string bytes_of(const std::vector<T>& values, bool swap = false) {
  std::string out;
  for (const T value : values) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (swap) std::reverse(bytes.begin(), bytes.end());
    out += bytes;
  }
  return out;
}

TEST(RawScalars, TypesAreFoundByKindAndSize) {
  for (const ScalarType type : kTypes) {
    const std::string word = name(type);
    const ScalarKind kind = word.starts_with("float")  ? ScalarKind::kFloat
                            : word.starts_with("uint") ? ScalarKind::kUnsigned
                                                       : ScalarKind::kSigned;
    EXPECT_EQ(find_scalar_type(kind, n_bytes(type)), type) << word;
    EXPECT_TRUE(word.ends_with(std::to_string(8 * n_bytes(type)))) << word;
  }
  for (const std::size_t size : {0, 3, 16}) {
    EXPECT_FALSE(find_scalar_type(ScalarKind::kSigned, size)) << size;
    EXPECT_FALSE(find_scalar_type(ScalarKind::kFloat, size)) << size;
  }
  EXPECT_FALSE(find_scalar_type(ScalarKind::kFloat, 2));
}

TEST(RawScalars, AreScaledInDouble) {
  check_scalar_types({"int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
                      "float32", "float64"},
                     [](const std::string& word, auto zero, const char*) {
                       using T = decltype(zero);
                       const std::vector<T> values = {T(1), T(100), T(7)};
                       const auto type =
                           kTypes[std::find_if(kTypes.begin(), kTypes.end(),
                                               [&](ScalarType t) { return name(t) == word; }) -
                                  kTypes.begin()];
                       for (const bool swap : {false, true}) {
                         const std::string stored = bytes_of(values, swap);
                         std::array<float, 2> out;
                         convert(type, swap, reinterpret_cast<const std::byte*>(stored.data()),
                                 /*stride=*/2, 0.5, -3, out.data(), out.size());
                         EXPECT_EQ(out[0], -2.5f) << word;
                         EXPECT_EQ(out[1], 0.5f) << word;
                       }
                     });
}

// 2^24 + 1 is no float, and in floats 16777217 - 16777216 would be 0.
TEST(RawScalars, LargeNumbersLoseNothingBeforeTheIntercept) {
  const std::string stored = bytes_of<std::int32_t>({16777217});
  float out = 0;
  convert(ScalarType::kInt32, false, reinterpret_cast<const std::byte*>(stored.data()), 1, 1,
          -16777216, &out, 1);
  EXPECT_EQ(out, 1);
}

TEST(RawScalars, NeedNoAlignment) {
  const std::string stored = "x" + bytes_of<double>({2.5});
  float out = 0;
  convert(ScalarType::kFloat64, false, reinterpret_cast<const std::byte*>(stored.data() + 1), 1, 2,
          0, &out, 1);
  EXPECT_EQ(out, 5);
}

class RawVolume : public Files {
 protected:
  /// Voxel n of frame f has the value 10 n + f.
  std::string frames(bool has_frames_fastest) const {
    std::vector<std::int16_t> values;
    for (int outer = 0; outer < (has_frames_fastest ? 12 : 3); ++outer)
      for (int inner = 0; inner < (has_frames_fastest ? 3 : 12); ++inner)
        values.push_back(
            std::int16_t(has_frames_fastest ? 10 * outer + inner : 10 * inner + outer));
    return write(has_frames_fastest ? "fastest" : "slowest", bytes_of(values, /*swap=*/true));
  }
  static RawLayout layout() {
    return {.size = {2, 3, 2},
            .type = ScalarType::kInt16,
            .is_big_endian = std::endian::native == std::endian::little,
            .n_frames = 3,
            .frame = 2};
  }
  static Volume read_from(const std::string& path, const RawLayout& layout) {
    ByteStream stream(path, 0, ByteStream::Encoding::kRaw);
    Source source;
    source.path = path;
    return read_raw(stream, layout, Eigen::Matrix4d::Identity(), source);
  }
};

TEST_F(RawVolume, HoldsTheFrameThatWasAskedFor) {
  for (const bool has_frames_fastest : {false, true}) {
    RawLayout of = layout();
    of.has_frames_fastest = has_frames_fastest;
    const Volume volume = read_from(frames(has_frames_fastest), of);
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 2; ++i)
          EXPECT_EQ(volume.value(i, j, k), 10 * ((k * 3 + j) * 2 + i) + 2) << has_frames_fastest;
    EXPECT_EQ(volume.source().n_frames, 3);
    EXPECT_EQ(volume.source().frame, 2);
    EXPECT_EQ(volume.source().scalar_type, "int16");
  }
}

TEST_F(RawVolume, RefusesFramesThatAreNotThereAndFilesThatEnd) {
  const std::string path = frames(false);
  RawLayout of = layout();
  of.frame = 3;
  EXPECT_THROW(read_from(path, of), InputError);
  of.frame = -1;
  EXPECT_THROW(read_from(path, of), InputError);
  of = layout();
  of.n_frames = 4;
  EXPECT_THROW(read_from(path, of), InputError);
}

// Their product overflows 64 bits to something small.
TEST_F(RawVolume, RefusesSizesWhoseProductOverflows) {
  RawLayout of = layout();
  of.size = {1 << 30, 1 << 30, 1 << 30};
  EXPECT_THROW(read_from(frames(false), of), InputError);
}

TEST(RawScalars, SizesAreThoseOfIntsFromOneOn) {
  EXPECT_EQ(checked_size("x", {2, 3, 4}), (std::array{2, 3, 4}));
  EXPECT_THROW(checked_size("x", {2, 0, 4}), InputError);
  EXPECT_THROW(checked_size("x", {2, -5, 4}), InputError);
  EXPECT_THROW(checked_size("x", {2, std::int64_t(1) << 31, 4}), InputError);
}

}  // namespace
}  // namespace surf::volume
