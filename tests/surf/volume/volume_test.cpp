#include "libsurf/volume/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"

namespace surf::volume {
namespace {

constexpr std::array<int, 3> kSize = {11, 9, 21};  // three slabs of slices

std::vector<float> values_of(const std::function<float(int i, int j, int k)>& value) {
  std::vector<float> out;
  for (int k = 0; k < kSize[2]; ++k)
    for (int j = 0; j < kSize[1]; ++j)
      for (int i = 0; i < kSize[0]; ++i) out.push_back(value(i, j, k));
  return out;
}

Volume volume_of(const std::vector<float>& values) {
  return Volume(kSize, Eigen::Affine3d::Identity(), values);
}

void expect_holds(const Volume& volume, const std::vector<float>& values) {
  std::vector<float> box(values.size());
  volume.copy_box({0, 0, 0}, kSize, box.data());
  EXPECT_EQ(box, values);
  std::vector<float> one_by_one =
      values_of([&](int i, int j, int k) { return volume.value(i, j, k); });
  EXPECT_EQ(one_by_one, values);
}

TEST(Volume, HoldsWholeNumbersInAsFewBytesAsTheyNeed) {
  const std::vector<float> bytes = values_of([](int i, int j, int k) {
    return float((7 * i + 5 * j + 3 * k) % 256);
  }),
                           words = values_of(
                               [](int i, int j, int k) { return float(300 * i - 2000 * j + k); }),
                           floats = values_of(
                               [](int i, int j, int k) { return 0.1f * float(i) - float(j * k); });
  for (const auto& [values, n_bytes] : {std::pair(bytes, 1), {words, 2}, {floats, 4}}) {
    const Volume volume = volume_of(values);
    EXPECT_EQ(volume.bytes_per_voxel(), n_bytes);
    expect_holds(volume, values);
  }
}

// Blocks of 8^3 voxels are held as one value where they have one, unless the volume ends in them.
TEST(Volume, KeepsBlocksOfOneValue) {
  for (const float scale : {1.0f, -100.0f, 0.3f}) {
    const std::vector<float> values = values_of([&](int i, int j, int k) {
      if (k >= 16) return 5 * scale;
      if (i >= 8 || j >= 8) return 0.0f;
      return k < 8 ? 3 * scale : (i == 2 && j == 3 && k == 12 ? scale : 0.0f);
    });
    expect_holds(volume_of(values), values);
  }
}

// Where rows begin and end within blocks of 8^3 voxels, in blocks of one value, and beyond the
// volume, where the nearest voxel's value goes on.
TEST(Volume, CopiesAnyBox) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> place(-12, 24), size(1, 20);
  for (const float scale : {1.0f, -100.0f, 0.3f}) {
    const Volume volume = volume_of(values_of([&](int i, int j, int k) {
      return k >= 8 && k < 16 ? 5 * scale : scale * float((7 * i + 5 * j + 3 * k) % 256);
    }));
    for (int n = 0; n < 200; ++n) {
      IndexBox<3> box;
      for (int axis = 0; axis < 3; ++axis) {
        box.lower[axis] = place(random);
        box.size[axis] = size(random);
      }
      std::vector<float> copied(box.n());
      volume.copy_box(box.lower, box.upper(), copied.data());
      for (std::size_t at = 0; at < box.n(); ++at) {
        const auto index = box.node(at);
        ASSERT_EQ(copied[at], volume.value(std::clamp(index[0], 0, kSize[0] - 1),
                                           std::clamp(index[1], 0, kSize[1] - 1),
                                           std::clamp(index[2], 0, kSize[2] - 1)))
            << index[0] << " " << index[1] << " " << index[2];
      }
    }
  }
}

TEST(Volume, KeepsTheSignOfZero) {
  std::vector<float> values = values_of([](int, int, int) { return 0; });
  values[700] = -0.0f;
  const Volume volume = volume_of(values);
  EXPECT_EQ(volume.bytes_per_voxel(), 4);
  EXPECT_TRUE(std::signbit(volume.value(700 % 11, 700 / 11 % 9, 700 / 99)));
}

TEST(Volume, NamesTheFirstVoxelThatIsNoNumber) {
  std::vector<float> values = values_of([](int, int, int) { return 1.0f; });
  const std::size_t slice = std::size_t(kSize[0]) * kSize[1];
  values[2 * slice + 3 * kSize[0] + 4] = std::nanf("");
  values[2 * slice + 3 * kSize[0] + 6] = std::nanf("");
  values[10 * slice] = INFINITY;
  try {
    volume_of(values);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("voxel (4, 3, 2) is NaN"), std::string::npos)
        << error.what();
  }
}

TEST(Volume, SaysWhereFloatsAreTooCoarseForItsContrast) {
  const auto n_notes = [](const char* type, float offset) {
    Source source;
    source.scalar_type = type;
    std::vector<float> values(8, offset);
    values[3] += 1000;
    Volume::Builder builder({2, 2, 2}, Eigen::Affine3d::Identity().matrix(), source);
    builder.append_slice({values.data(), 4});
    builder.append_slice({values.data() + 4, 4});
    return builder.finish().source().notes.size();
  };
  EXPECT_EQ(n_notes("float64", 1e9f), 1u);
  EXPECT_EQ(n_notes("uint32", 1e9f), 1u);
  EXPECT_EQ(n_notes("float64", 1e6f), 0u);
  EXPECT_EQ(n_notes("float32", 1e9f), 0u);  // as they are stored
}

TEST(Volume, RefusesVoxelsOfNanometres) {
  const std::vector<float> values(8, 1.0f);
  for (const double size : {1e-4, 1e-6}) {
    const Eigen::Affine3d affine(Eigen::Scaling(size));
    try {
      Volume({2, 2, 2}, affine, values);
      EXPECT_GT(size, 1e-5);
    } catch (const InputError& error) {
      EXPECT_LT(size, 1e-5);
      EXPECT_NE(std::string(error.what()).find("1e-06 x 1e-06 x 1e-06 mm"), std::string::npos)
          << error.what();
    }
  }
}

TEST(Volume, KeepsTheLimitsOfItsIntegers) {
  for (const auto& [value, n_bytes] : {std::pair(255.0f, 1),
                                       {256.0f, 2},
                                       {-1.0f, 2},
                                       {-32768.0f, 2},
                                       {32767.0f, 2},
                                       {32768.0f, 4},
                                       {-32769.0f, 4},
                                       {1e17f, 4}}) {
    std::vector<float> values(volume_of(values_of([](int, int, int) { return 0; })).n_voxels());
    values[5] = value;
    const Volume volume = volume_of(values);
    EXPECT_EQ(volume.bytes_per_voxel(), n_bytes) << value;
    expect_holds(volume, values);
  }
}

TEST(Volume, WidensWhatItHasWhenALaterSliceNeedsIt) {
  for (const auto& [later, last, n_bytes] :
       {std::tuple(-1000.0f, 3.0f, 2), {3.0f, 0.5f, 4}, {-1000.0f, 0.5f, 4}, {70000.0f, 3.0f, 4}}) {
    const auto values = values_of([later = later, last = last](int i, int j, int k) {
      return k < 8 ? float(i + j) : k < 16 ? later : last;
    });
    const Volume volume = volume_of(values);
    EXPECT_EQ(volume.bytes_per_voxel(), n_bytes);
    expect_holds(volume, values);
  }
}

TEST(Volume, OfIntegersIsTheSameInAnotherOrderOfTheAxes) {
  Eigen::Affine3d turned = Eigen::Affine3d::Identity();
  turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, -1;
  const auto values = values_of([](int i, int j, int k) { return float(i + 20 * j - 200 * k); });
  const Volume volume(kSize, turned, values), ordered = volume.in_ras_order();
  EXPECT_EQ(ordered.bytes_per_voxel(), 2);
  for (const Eigen::Vector3d& index : {Eigen::Vector3d(0, 0, 0), {3, 7, 11}, {10, 8, 20}}) {
    const Eigen::Vector3d there = ordered.world_to_index() * (turned * index);
    EXPECT_EQ(ordered.value(int(std::lround(there[0])), int(std::lround(there[1])),
                            int(std::lround(there[2]))),
              volume.value(int(index[0]), int(index[1]), int(index[2])));
  }
}

}  // namespace
}  // namespace surf::volume
