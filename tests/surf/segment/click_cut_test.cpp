#include "libsurf/segment/click_cut.h"

#include <gtest/gtest.h>

#include "tests/surf/fixtures.h"
#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

using test::ClickImage;
using test::inside;
using test::outside;
using test::point;

template <class T>
struct ClickCut : ::testing::Test {
  static constexpr int kDim = T::value;
  const ClickImage<kDim> image{test::is_in_dumbbell<kDim>};
  const Flags both = image.flags(test::is_in_dumbbell<kDim>);
  Flags ball(double x) const {
    return image.flags(
        [x](const Vector<kDim>& at) { return test::is_in_ball<kDim>(at, point<kDim>(x), 9); });
  }
  Flags cut(const Flags& before, const std::vector<Click<kDim>>& clicks,
            const ClickCutOptions& options = {}, double object = 0) const {
    ClickScene<kDim> scene{image.grid, before, {}, 0.03};
    for (const Click<kDim>& click : clicks) scene.clicks.push_back(image.on_grid(click));
    return click_cuts(scene, std::array{object}, options).front();
  }
};
TYPED_TEST_SUITE(ClickCut, test::Dims, test::DimName);

TYPED_TEST(ClickCut, PartsAlikeBallsBetweenTheirClicks) {
  constexpr int Dim = TypeParam::value;
  const Flags found = this->cut(this->both, {inside<Dim>(14), outside<Dim>(34)});
  EXPECT_GT(ClickImage<Dim>::dice(found, this->ball(14)), 0.9);
}

TYPED_TEST(ClickCut, FindsWhatAllInsideClicksShow) {
  constexpr int Dim = TypeParam::value;
  ClickCutOptions far;
  far.margin = 1;
  const Flags found = this->cut(this->ball(14), {inside<Dim>(14), inside<Dim>(34)}, far);
  EXPECT_GT(ClickImage<Dim>::dice(found, this->both), 0.95);
}

TYPED_TEST(ClickCut, KeepsToTheObjectByItsWeight) {
  constexpr int Dim = TypeParam::value;
  const Flags found = this->cut(this->both, {inside<Dim>(14), outside<Dim>(34)}, {}, 10);
  EXPECT_GT(ClickImage<Dim>::dice(found, this->both), 0.9);
}

// Twice as coarse the result is the same but for nodes at the boundary.
TYPED_TEST(ClickCut, LooksAtLargeBoxesWithLongerSteps) {
  constexpr int Dim = TypeParam::value;
  ClickCutOptions coarse;
  coarse.most_nodes = 100;
  const Flags found = this->cut(this->both, {inside<Dim>(14), outside<Dim>(34)}, coarse);
  EXPECT_GT(ClickImage<Dim>::dice(found, this->ball(14)), 0.85);
}

}  // namespace
}  // namespace surf::segment
