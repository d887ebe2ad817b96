#include "libsurf/segment/detail/click_cut.h"

#include <gtest/gtest.h>

#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

template <class T>
struct ClickCut : test::DumbbellTest<T> {
  using test::DumbbellTest<T>::kDim;
  NodeSet<kDim> cut(const NodeSet<kDim>& before, const std::vector<Click<kDim>>& clicks,
                    const ClickCutOptions& options = {}, double object = 0) const {
    return click_cuts(this->scene(before, clicks), std::array{object}, options).inside.front();
  }
};
TYPED_TEST_SUITE(ClickCut, test::Dims, test::DimName);

TYPED_TEST(ClickCut, PartsAlikeBallsBetweenTheirClicks) {
  const auto found = this->cut(this->both, {this->inside(14), this->outside(34)});
  EXPECT_GT(this->dice(found, this->ball(14)), 0.9);
}

TYPED_TEST(ClickCut, FindsWhatAllInsideClicksShow) {
  ClickCutOptions far;
  far.margin = 1;
  const auto found = this->cut(this->ball(14), {this->inside(14), this->inside(34)}, far);
  EXPECT_GT(this->dice(found, this->both), 0.95);
}

TYPED_TEST(ClickCut, TellsWhatEachNodeCosts) {
  constexpr int Dim = TypeParam::value;
  const ClickScene<Dim> scene = this->scene(this->both, {this->inside(14), this->outside(34)});
  const std::vector<float> costs = click_cuts(scene, std::array{0.0}).costs;
  ASSERT_EQ(costs.size(), scene.box().n());
  double of_inner = 0, of_outer = 0;
  this->ball(14).for_each([&](std::size_t at) { of_inner += costs[at]; });
  this->ball(34).for_each([&](std::size_t at) { of_outer += costs[at]; });
  EXPECT_GT(of_inner, 0.5 * double(this->ball(14).count()));
  EXPECT_LT(of_outer, -0.3 * double(this->ball(34).count()));
}

TYPED_TEST(ClickCut, KeepsToTheObjectByItsWeight) {
  const auto found = this->cut(this->both, {this->inside(14), this->outside(34)}, {}, 10);
  EXPECT_GT(this->dice(found, this->both), 0.9);
}

// Twice as coarse the result is the same but for nodes at the boundary.
TYPED_TEST(ClickCut, LooksAtLargeBoxesWithLongerSteps) {
  ClickCutOptions coarse;
  coarse.most_nodes = 100;
  const auto found = this->cut(this->both, {this->inside(14), this->outside(34)}, coarse);
  EXPECT_GT(this->dice(found, this->ball(14)), 0.85);
}

}  // namespace
}  // namespace surf::segment
