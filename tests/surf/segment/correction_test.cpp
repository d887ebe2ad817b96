#include "libsurf/segment/correction.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

template <class T>
struct Corrections : test::DumbbellTest<T> {
  using test::DumbbellTest<T>::kDim;
  std::vector<Correction<kDim>> correct(const NodeSet<kDim>& before,
                                        const std::vector<Click<kDim>>& clicks) const {
    return corrections<kDim>(this->image.grid, before, this->scene(before, clicks).clicks, {},
                             0.03);
  }
  NodeSet<kDim> after(const NodeSet<kDim>& before, const Correction<kDim>& correction) const {
    const NodeSet<kDim> in_part = before.in(correction.inside.box());
    return before ^ (in_part ^ correction.inside).in(before.box());
  }
};
TYPED_TEST_SUITE(Corrections, test::Dims, test::DimName);

TYPED_TEST(Corrections, AnInsideClickAddsWhatItStandsFor) {
  const auto before = this->ball(14);
  const auto found = this->correct(before, {this->inside(14), this->inside(34)});
  ASSERT_FALSE(found.empty());
  EXPECT_GT(this->dice(this->after(before, found.front()), this->both), 0.95);
}

TYPED_TEST(Corrections, AnOutsideClickTakesAwayWhatItStandsFor) {
  const auto found = this->correct(this->both, {this->inside(14), this->outside(34)});
  ASSERT_FALSE(found.empty());
  const auto after = this->after(this->both, found.front());
  EXPECT_GT(this->image.covered(this->ball(14), after), 0.97);
  EXPECT_LT(this->image.covered(this->ball(34), after), 0.2);
}

TYPED_TEST(Corrections, AllOfThemObeyAllClicksBestFirst) {
  constexpr int Dim = TypeParam::value;
  const std::vector<Click<Dim>> clicks = {this->inside(14), this->outside(34),
                                          this->outside(14, 12), this->inside(28)};
  const auto found = this->correct(this->ball(14), clicks);
  ASSERT_FALSE(found.empty());
  for (std::size_t n = 0; n < found.size(); ++n) {
    EXPECT_LE(found[n].score, found[n > 0 ? n - 1 : 0].score);
    const auto after = this->after(this->ball(14), found[n]);
    for (const Click<Dim>& click : clicks)
      for (const auto& node : this->image.on_grid(click).seed.nodes)
        EXPECT_EQ(after.contains(node), click.side == Side::kInside);
  }
}

// Else the ball of an earlier click was cut off at its neck but for the nodes that the click holds.
TYPED_TEST(Corrections, EarlierClicksStayDeep) {
  for (const double x : {30, 38}) {
    const auto found =
        this->correct(this->both, {this->inside(14), this->inside(34), this->outside(x, 27)});
    ASSERT_FALSE(found.empty());
    EXPECT_GT(this->image.covered(this->ball(34), this->after(this->both, found.front())), 0.5);
  }
}

// A cut between all clicks would mend the dent as well, which nobody has clicked.
TYPED_TEST(Corrections, ACutMayChangeNothingButWhatIsClicked) {
  const auto ball = this->ball(14);
  const auto dented = ball - this->ball(2);
  ASSERT_LT(dented.count(), ball.count());
  const auto found = this->correct(dented, {this->inside(14), this->inside(34)});
  EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const auto& correction) {
    const auto after = this->after(dented, correction);
    return correction.family == Family::kCut && (after & (ball - dented)).is_empty() &&
           this->image.covered(dented, after) > 0.98 &&
           this->image.covered(this->ball(34), after) > 0.6;
  }));
}

// What nothing in the image supports is held where it was clicked, and nowhere else.
TYPED_TEST(Corrections, HoldTheClickWhereNothingElseIsToBeSeen) {
  const auto before = this->ball(14);
  const auto found = this->correct(before, {this->inside(14), this->outside(14, 27)});
  ASSERT_FALSE(found.empty());
  EXPECT_GT(this->dice(this->after(before, found.front()), before), 0.7);
}

}  // namespace
}  // namespace surf::segment
