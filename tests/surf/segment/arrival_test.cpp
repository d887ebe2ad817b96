#include "libsurf/segment/detail/arrival.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

template <class T>
struct Arrival : ::testing::Test {
  static constexpr int kDim = T::value;
  static NodeBox<kDim> box(int size = 13) {
    return NodeBox<kDim>::cube(2, size);  // numbers of nodes do not depend on the first
  }
  static std::size_t center(const NodeBox<kDim>& box) { return box.n() / 2; }
};
TYPED_TEST_SUITE(Arrival, test::Dims, test::DimName);

// Ways along axes and diagonals: no shorter than the straight one, at most 1 / cos(pi / 8) and
// 1.13 times as long in space.
TYPED_TEST(Arrival, IsTheDistanceWhereTheCostIsOne) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  const std::vector<std::size_t> starts = {this->center(box)};
  const auto time = arrival_times<Dim>(box, std::vector<float>(box.n(), 1.f), starts, box.n());
  for (std::size_t at = 0; at < box.n(); ++at) {
    double squared = 0;
    for (int axis = 0; axis < Dim; ++axis)
      squared += std::pow(box.node(at)[axis] - box.node(starts[0])[axis], 2);
    EXPECT_GE(time[at], std::sqrt(squared) * (1 - 1e-5));
    EXPECT_LE(time[at], std::sqrt(squared) * 1.13);
  }
}

TYPED_TEST(Arrival, IsLaterBehindWhatCostsMore) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  std::vector<float> cost(box.n(), 1);
  for (std::size_t at = 0; at < box.n(); ++at)
    if (box.node(at)[0] - box.lower[0] == 9) cost[at] = 50;
  const std::vector<std::size_t> starts = {this->center(box)};
  const auto time = arrival_times<Dim>(box, cost, starts, box.n());
  auto near = box.node(starts[0]), far = near;
  near[0] -= 4;
  far[0] += 4;
  EXPECT_NEAR(time[box.at(near)], 4, 1e-5);
  EXPECT_NEAR(time[box.at(far)], 4 - 1 + 50, 1e-4);  // half of both steps at the wall's cost
}

TYPED_TEST(Arrival, NeverEntersWhatCostsInfinity) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  std::vector<float> cost(box.n(), 1);
  for (std::size_t at = 0; at < box.n(); ++at)
    if (box.node(at)[0] - box.lower[0] == 9) cost[at] = std::numeric_limits<float>::infinity();
  const std::vector<std::size_t> starts = {this->center(box)};
  const auto time = arrival_times<Dim>(box, cost, starts, box.n());
  for (std::size_t at = 0; at < box.n(); ++at)
    EXPECT_EQ(std::isfinite(time[at]), box.node(at)[0] - box.lower[0] < 9);
}

TYPED_TEST(Arrival, EndsWhenItHasCoveredEnoughButKeepsWhatIsEquallyFar) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  const std::vector<std::size_t> starts = {this->center(box)};
  const std::vector<float> cost(box.n(), 1);
  const auto all = arrival_times<Dim>(box, cost, starts, box.n());
  const auto some = arrival_times<Dim>(box, cost, starts, 4);
  std::size_t n_covered = 0;
  for (std::size_t at = 0; at < box.n(); ++at) {
    if (!std::isfinite(some[at])) continue;
    ++n_covered;
    EXPECT_EQ(some[at], all[at]);
  }
  EXPECT_EQ(n_covered, 1 + 2 * Dim);  // the start and those a node away
}

// Along a ramp the values differ by as much on every way, and the shortest one is straight.
TYPED_TEST(Arrival, GeodesicsCostTheDifferencesAndTheLength) {
  constexpr int Dim = TypeParam::value;
  const auto box = this->box();
  std::vector<float> ramp(box.n());
  for (std::size_t at = 0; at < ramp.size(); ++at) ramp[at] = 2.f * float(box.node(at)[0]);
  const std::vector<std::size_t> starts = {this->center(box)};
  const auto distance = geodesic_distances<Dim>(box, ramp, starts, 0.5f);
  const auto first = box.node(starts[0]);
  for (const int by : {-5, 3, 6}) {
    auto node = first;
    node[0] += by;
    EXPECT_NEAR(distance[box.at(node)], 2.5 * std::abs(by), 1e-4);
    node = first;
    node[1] += by;
    EXPECT_NEAR(distance[box.at(node)], 0.5 * std::abs(by), 1e-4);
  }
}

}  // namespace
}  // namespace surf::segment
