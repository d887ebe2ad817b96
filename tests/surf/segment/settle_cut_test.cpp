#include "libsurf/segment/settle_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

constexpr double kNoise = 0.05;

template <class T>
struct SettleCut : ::testing::Test {
  static constexpr int kDim = T::value;
  static NodeBox<kDim> box() { return NodeBox<kDim>::cube(-3, 31); }
  /// From the middle of the box [nodes].
  static double radius(std::size_t at) {
    double squared = 0;
    for (int axis = 0; axis < kDim; ++axis)
      squared += std::pow(box().node(at)[axis] - box().lower[axis] - 15, 2);
    return std::sqrt(squared);
  }
  static Flags ball(double r) {
    Flags out(box().n());
    for (std::size_t at = 0; at < out.size(); ++at) out[at] = radius(at) < r;
    return out;
  }
  /// One inside of r, 0 outside.
  static std::vector<float> image(double r, double noise = kNoise) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::vector<float> out(box().n());
    for (std::size_t at = 0; at < out.size(); ++at)
      out[at] = float((radius(at) < r) + noise * normal(random));
    return out;
  }
  static std::size_t n_different(const Flags& a, const Flags& b) {
    std::size_t out = 0;
    for (std::size_t at = 0; at < a.size(); ++at) out += a[at] != b[at];
    return out;
  }
};
TYPED_TEST_SUITE(SettleCut, test::Dims, test::DimName);

TYPED_TEST(SettleCut, FindsTheEdgeFromBothSides) {
  constexpr int Dim = TypeParam::value;
  for (const double start : {7.5, 10.5})
    EXPECT_EQ(
        this->n_different(settled<Dim>(this->box(), this->ball(start), this->image(9), {}, kNoise),
                          this->ball(9)),
        0u)
        << start;
}

// A stronger edge beyond is left alone where the nodes before it are known to be outside.
TYPED_TEST(SettleCut, HeedsWhatNodesCostBesides) {
  constexpr int Dim = TypeParam::value;
  const std::vector<float> image = this->image(11);
  std::vector<float> costs(image.size());
  for (std::size_t at = 0; at < costs.size(); ++at) costs[at] = this->radius(at) < 9 ? 4 : -8;
  const Flags start = this->ball(9), beyond = this->ball(11);
  EXPECT_EQ(this->n_different(settled<Dim>(this->box(), start, image, {}, kNoise), beyond), 0u);
  EXPECT_LT(this->n_different(settled<Dim>(this->box(), start, image, {}, kNoise, costs), start),
            this->n_different(start, beyond) / 20);
}

TYPED_TEST(SettleCut, MovesNoFurtherThanTheBand) {
  constexpr int Dim = TypeParam::value;
  SettleOptions options;
  options.width = 2;
  const Flags start = this->ball(5),
              found = settled<Dim>(this->box(), start, this->image(11), {}, kNoise, {}, options);
  for (std::size_t at = 0; at < found.size(); ++at) {
    if (this->radius(at) < 2.5) {
      EXPECT_TRUE(found[at]);
    }
    if (this->radius(at) > 8) {
      EXPECT_FALSE(found[at]);
    }
  }
}

TYPED_TEST(SettleCut, LeavesWhatIsHeld) {
  constexpr int Dim = TypeParam::value;
  std::vector<Held> held(this->box().n(), Held::kFree);
  for (std::size_t at = 0; at < held.size(); ++at) {
    const int x = this->box().node(at)[0] - this->box().lower[0];
    if (std::abs(this->radius(at) - 9.5) < 0.5) held[at] = x < 15 ? Held::kInside : Held::kFree;
    if (std::abs(this->radius(at) - 8.5) < 0.5 && x > 16) held[at] = Held::kOutside;
  }
  const Flags found = settled<Dim>(this->box(), this->ball(9), this->image(9), held, kNoise);
  for (std::size_t at = 0; at < held.size(); ++at) {
    if (held[at] == Held::kInside) {
      EXPECT_TRUE(found[at]);
    }
    if (held[at] == Held::kOutside) {
      EXPECT_FALSE(found[at]);
    }
  }
}

TYPED_TEST(SettleCut, LeavesTheRegionWhereNothingIsSeen) {
  constexpr int Dim = TypeParam::value;
  const std::vector<float> nothing(this->box().n(), 2);
  EXPECT_EQ(settled<Dim>(this->box(), this->ball(8), nothing, {}, 0), this->ball(8));
}

TYPED_TEST(SettleCut, SeesNoUnitAndNoOrigin) {
  constexpr int Dim = TypeParam::value;
  std::vector<float> image = this->image(9, 0.3);
  const Flags plain = settled<Dim>(this->box(), this->ball(8), image, {}, 0.3);
  for (float& value : image) value = 1024 * value - 512;
  EXPECT_EQ(settled<Dim>(this->box(), this->ball(8), image, {}, 1024 * 0.3), plain);
  for (float& value : image) value = -value;
  EXPECT_EQ(settled<Dim>(this->box(), this->ball(8), image, {}, 1024 * 0.3), plain);
}

// Sums are rounded in another order, capacities are whole numbers: the same but for a few nodes.
TYPED_TEST(SettleCut, FlipsWithTheAxes) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  const std::vector<float> image = this->image(9, 0.5);
  const Flags start = this->ball(8), plain = settled<Dim>(box, start, image, {}, 0.5);
  const auto flipped = [&](const auto& values) {
    auto out = values;
    for (std::size_t at = 0; at < box.n(); ++at) {
      auto node = box.node(at);
      node[0] = 2 * box.lower[0] + box.size[0] - 1 - node[0];
      out[at] = values[box.at(node)];
    }
    return out;
  };
  EXPECT_GT(this->n_different(plain, start), 20u);
  EXPECT_LE(
      this->n_different(flipped(settled<Dim>(box, flipped(start), flipped(image), {}, 0.5)), plain),
      2u);
}

}  // namespace
}  // namespace surf::segment
