#include "libsurf/base/padding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace surf {
namespace {

using Index = std::array<int, 3>;

/// What a value at an index is, as noise is: another one at each.
float noise(const Index& index) {
  auto hash = std::uint32_t(index[0] * 73856093 ^ index[1] * 19349663 ^ index[2] * 83492791);
  hash = (hash ^ hash >> 13) * 2654435761u;
  return float(hash >> 20) / 4096;
}

template <class Value>
IndexBox<3> found(const Index& size, const Value& value) {
  return box_within_padding<3>(size, [&](const Index& lower, const Index& upper) {
    const IndexBox<3> box = IndexBox<3>::between(lower, upper);
    std::vector<float> out;
    for (std::size_t at = 0; at < box.n(); ++at) out.push_back(value(box.node(at)));
    return out;
  });
}

void expect_box(const IndexBox<3>& box, const Index& lower, const Index& upper) {
  EXPECT_EQ(box.lower, lower);
  EXPECT_EQ(box.upper(), upper);
}

constexpr Index kSize = {40, 37, 29};

TEST(Padding, IsNoneOfAScan) { expect_box(found(kSize, noise), {0, 0, 0}, kSize); }

TEST(Padding, EndsWhereTheScanBegins) {
  for (const float value : {-1024.f, 0.f, 7.f}) {
    const auto padded = [&](const IndexBox<3>& scan) {
      return [scan, value](const Index& at) { return scan.contains(at) ? noise(at) : value; };
    };
    const IndexBox<3> within = IndexBox<3>::between({10, 3, 1}, {30, 36, 20});
    expect_box(found(kSize, padded(within)), within.lower, within.upper());
    const IndexBox<3> slices = IndexBox<3>::between({0, 0, 0}, {40, 37, 24});
    expect_box(found(kSize, padded(slices)), slices.lower, slices.upper());
  }
}

TEST(Padding, IsNoBackgroundOfAnObject) {
  const auto is_in_ball = [](const Index& at) {
    return std::hypot(at[0] - 20, at[1] - 18, at[2] - 14) < 9;
  };
  expect_box(found(kSize, [&](const Index& at) { return is_in_ball(at) ? noise(at) + 5 : 0.f; }),
             {0, 0, 0}, kSize);
  // Without noise a box is an object, too.
  const IndexBox<3> body = IndexBox<3>::between({10, 10, 10}, {30, 30, 20});
  expect_box(found(kSize, [&](const Index& at) { return body.contains(at) ? 1.f : 0.f; }),
             {0, 0, 0}, kSize);
  expect_box(found(kSize, [](const Index&) { return 3.f; }), {0, 0, 0}, kSize);
}

// A leg that the end of the scan cuts off, padded on; its sides are those of an object.
TEST(Padding, EndsAtAPartOfALayer) {
  const auto value = [](const Index& at) {
    const double radius = at[2] < 15 ? 14 : 17;
    return at[2] >= 5 && std::hypot(at[0] - 20, at[1] - 18) < radius ? noise(at) + 1 : 0.f;
  };
  expect_box(found(kSize, value), {0, 0, 5}, kSize);
}

// One voxel in it that differs: nobody has padded so.
TEST(Padding, HasOneValueAlone) {
  const IndexBox<3> scan = IndexBox<3>::between({10, 0, 0}, kSize);
  expect_box(found(kSize,
                   [&](const Index& at) {
                     return scan.contains(at) || at == Index{4, 2, 2} ? noise(at) : 0.f;
                   }),
             {0, 0, 0}, kSize);
}

TEST(Padding, LeavesAnImageOfThreeCells) {
  const IndexBox<3> scan = IndexBox<3>::between({10, 0, 0}, {12, 37, 29});
  expect_box(found(kSize, [&](const Index& at) { return scan.contains(at) ? noise(at) : 0.f; }),
             {0, 0, 0}, kSize);
}

TEST(Padding, OfImages) {
  const IndexBox<2> scan = IndexBox<2>::between({4, 0}, {30, 20});
  const IndexBox<2> box =
      box_within_padding<2>({35, 24}, [&](const auto& lower, const auto& upper) {
        const IndexBox<2> part = IndexBox<2>::between(lower, upper);
        std::vector<float> out;
        for (std::size_t at = 0; at < part.n(); ++at) {
          const auto pixel = part.node(at);
          out.push_back(scan.contains(pixel) ? noise({pixel[0], pixel[1], 0}) : 255.f);
        }
        return out;
      });
  EXPECT_EQ(box.lower, scan.lower);
  EXPECT_EQ(box.size, scan.size);
}

}  // namespace
}  // namespace surf
