#include "libsurf/segment/correction.h"

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
struct Corrections : ::testing::Test {
  static constexpr int kDim = T::value;
  const ClickImage<kDim> image{test::is_in_dumbbell<kDim>};
  const Flags both = image.flags(test::is_in_dumbbell<kDim>);
  Flags ball(double x) const {
    return image.flags(
        [x](const Vector<kDim>& at) { return test::is_in_ball<kDim>(at, point<kDim>(x), 9); });
  }
  std::vector<Correction<kDim>> correct(const Flags& before,
                                        const std::vector<Click<kDim>>& clicks) const {
    std::vector<GridClick<kDim>> on_grid;
    for (const Click<kDim>& click : clicks) on_grid.push_back(image.on_grid(click));
    return corrections<kDim>(image.grid, before, on_grid, {}, 0.03);
  }
  Flags after(const Flags& before, const Correction<kDim>& correction) const {
    Flags out = before;
    for (std::size_t at = 0; at < correction.inside.size(); ++at)
      out[image.grid.box().at(correction.box.node(at))] = correction.inside[at];
    return out;
  }
};
TYPED_TEST_SUITE(Corrections, test::Dims, test::DimName);

TYPED_TEST(Corrections, AnInsideClickAddsWhatItStandsFor) {
  constexpr int Dim = TypeParam::value;
  const Flags before = this->ball(14);
  const auto found = this->correct(before, {inside<Dim>(14), inside<Dim>(34)});
  ASSERT_FALSE(found.empty());
  EXPECT_GT(ClickImage<Dim>::dice(this->after(before, found.front()), this->both), 0.95);
}

TYPED_TEST(Corrections, AnOutsideClickTakesAwayWhatItStandsFor) {
  constexpr int Dim = TypeParam::value;
  const auto found = this->correct(this->both, {inside<Dim>(14), outside<Dim>(34)});
  ASSERT_FALSE(found.empty());
  const Flags after = this->after(this->both, found.front());
  EXPECT_GT(ClickImage<Dim>::covered(this->ball(14), after), 0.97);
  EXPECT_LT(ClickImage<Dim>::covered(this->ball(34), after), 0.2);
}

TYPED_TEST(Corrections, AllOfThemObeyAllClicksBestFirst) {
  constexpr int Dim = TypeParam::value;
  const std::vector<Click<Dim>> clicks = {inside<Dim>(14), outside<Dim>(34), outside<Dim>(14, 12),
                                          inside<Dim>(28)};
  const auto found = this->correct(this->ball(14), clicks);
  ASSERT_FALSE(found.empty());
  for (std::size_t n = 0; n < found.size(); ++n) {
    EXPECT_LE(found[n].score, found[n > 0 ? n - 1 : 0].score);
    const Flags after = this->after(this->ball(14), found[n]);
    for (const Click<Dim>& click : clicks)
      for (const auto& node : this->image.on_grid(click).seed.nodes)
        EXPECT_EQ(bool(after[this->image.grid.box().at(node)]), click.side == Side::kInside);
  }
}

// What nothing in the image supports is held where it was clicked, and nowhere else.
TYPED_TEST(Corrections, HoldTheClickWhereNothingElseIsToBeSeen) {
  constexpr int Dim = TypeParam::value;
  const Flags before = this->ball(14);
  const auto found = this->correct(before, {inside<Dim>(14), outside<Dim>(14, 27)});
  ASSERT_FALSE(found.empty());
  EXPECT_GT(ClickImage<Dim>::dice(this->after(before, found.front()), before), 0.7);
}

}  // namespace
}  // namespace surf::segment
