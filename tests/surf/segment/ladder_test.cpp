#include "libsurf/segment/ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "tests/surf/fixtures.h"
#include "tests/surf/segment/lattice_image.h"

namespace surf::segment {
namespace {

const std::vector<double> kRadii = {1, 2, 6};

template <class T>
struct Ladders : ::testing::Test {
  static constexpr int kDim = T::value;

  /// A ball of radius 12 in the middle, twice as bright in one half, in noise.
  Ladders()
      : image(test::image_of<kDim>(
            [](const Vector<kDim>& x) {
              const bool is_inside = (x - Vector<kDim>::Constant(24)).norm() < 12;
              return is_inside ? (x[0] > 24 ? 2.0 : 1.0) : 0.0;
            },
            0.03)),
        grid(image, image.extent(), {image.extent(), 3e6}),
        view(grid, std::vector<Vector<kDim>>{Vector<kDim>::Constant(20)}) {}

  std::vector<Windows<kDim>> climbed(const Ladder& ladder, int* n_done = nullptr,
                                     const std::stop_token& stop = {}) const {
    std::atomic<int> n = 0;
    auto out = climb<kDim>(
        view, std::span<const Ladder>(&ladder, 1), [&](const Rung<kDim>*) { ++n; }, stop);
    if (n_done) *n_done = n;
    return out;
  }

  test::LatticeImage<kDim> image;
  SearchGrid<kDim> grid;
  SeedView<kDim> view;
};
TYPED_TEST_SUITE(Ladders, test::Dims, test::DimName);

TYPED_TEST(Ladders, RiseFromTheDeviationOfTheSeed) {
  for (const Family family : {Family::kAlike, Family::kBrighter, Family::kFront}) {
    const Ladder ladder = make_ladder(this->view, family, kRadii);
    ASSERT_GT(ladder.levels.size(), 3u);
    EXPECT_TRUE(std::is_sorted(ladder.levels.begin(), ladder.levels.end()));
    EXPECT_EQ(ladder.distance.size(), this->grid.box().n());
  }
}

TYPED_TEST(Ladders, HoldWhatIsBrighterAtOnceOrNot) {
  const auto center = this->grid.box().at(this->view.seeds[0].nodes[0]);
  auto bright = this->view.seeds[0].nodes[0];
  bright[0] += 8;
  const Ladder alike = make_ladder(this->view, Family::kAlike, kRadii),
               brighter = make_ladder(this->view, Family::kBrighter, kRadii);
  EXPECT_NEAR(alike.distance[this->grid.box().at(bright)], 1, 0.2);
  EXPECT_EQ(brighter.distance[this->grid.box().at(bright)], 0);
  EXPECT_LT(brighter.distance[center], 0.1);
}

TYPED_TEST(Ladders, OfFrontsGrowByHalf) {
  const Ladder ladder = make_ladder(this->view, Family::kFront, kRadii);
  std::size_t last = 0;
  for (const double level : ladder.levels) {
    const auto n = std::size_t(std::count_if(ladder.distance.begin(), ladder.distance.end(),
                                             [&](float time) { return time <= level; }));
    if (last > 0) {
      EXPECT_NEAR(double(n) / double(last), 1.5, 0.25);
    }
    last = n;
  }
}

TYPED_TEST(Ladders, TellOfEachWindowAndStopWhereTheyFillTheGrid) {
  const Ladder ladder = make_ladder(this->view, Family::kBrighter, kRadii);
  int n_done = 0;
  const auto windows = this->climbed(ladder, &n_done).front();
  EXPECT_EQ(n_done, int(ladder.levels.size()));
  const double n_grid = double(this->grid.box().n());
  for (const auto& window : windows)
    for (const auto& rung : window)
      if (double(rung.n_nodes) > kLargestShare * n_grid) {
        EXPECT_EQ(rung.score, 0);
        EXPECT_EQ(&window, &windows.back());
      }
}

TYPED_TEST(Ladders, FindTheBrighterHalfInOneStep) {
  constexpr int Dim = TypeParam::value;
  const auto windows = this->climbed(make_ladder(this->view, Family::kBrighter, kRadii)).front();
  const Rung<Dim>* best = nullptr;
  for (const auto& window : windows)
    for (const auto& rung : window)
      if (!best || rung.score > best->score) best = &rung;
  ASSERT_TRUE(best);
  const double content = Dim == 2 ? 3.14159 * 144 : 4.18879 * 1728;
  EXPECT_NEAR(double(best->n_nodes) / content, 1, 0.25);  // to the foot of the edge: a node
}

TYPED_TEST(Ladders, LeaveOutWhatAStopLeaves) {
  std::stop_source stop;
  stop.request_stop();
  const auto windows =
      this->climbed(make_ladder(this->view, Family::kAlike, kRadii), nullptr, stop.get_token());
  for (const auto& window : windows.front())
    for (const auto& rung : window) EXPECT_EQ(rung.n_nodes, 0u);
}

}  // namespace
}  // namespace surf::segment
