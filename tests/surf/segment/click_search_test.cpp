#include "libsurf/segment/click_search.h"

#include <gtest/gtest.h>

#include "libsurf/base/threads.h"
#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

template <class T>
struct ClickSearches : test::DumbbellTest<T> {
  using test::DumbbellTest<T>::kDim;
  ClickSearchPointer<kDim> search(const std::vector<Click<kDim>>& clicks,
                                  ClickSearchPointer<kDim> known = nullptr,
                                  const std::stop_token& stop = {}) const {
    return search_clicks<kDim>(this->image.grid, clicks, std::move(known), {}, {}, stop);
  }
};
TYPED_TEST_SUITE(ClickSearches, test::Dims, test::DimName);

TYPED_TEST(ClickSearches, HeedsClicksOneAfterTheOther) {
  const auto found = this->search({this->inside(14), this->inside(34)});
  ASSERT_TRUE(found && !found->found.empty());
  EXPECT_GT(this->dice(found->inside(), this->both), 0.95);
  ASSERT_TRUE(found->before);
  EXPECT_EQ(found->before->clicks.size(), 1u);
  EXPECT_FALSE(found->before->before);
}

TYPED_TEST(ClickSearches, GoesOnFromWhatIsKnownToTheSame) {
  constexpr int Dim = TypeParam::value;
  const std::vector<Click<Dim>> clicks = {this->inside(14), this->inside(34), this->outside(24)};
  const auto first = this->search({clicks[0]});
  const auto second = this->search({clicks[0], clicks[1]}, first);
  EXPECT_EQ(second->before, first);  // taken over
  const auto third = this->search(clicks, second);
  const auto at_once = this->search(clicks);
  EXPECT_EQ(third->inside(), at_once->inside());
  EXPECT_EQ(third->found.front().score, at_once->found.front().score);
  // A click is taken back: what is left in common is the first one.
  const auto other = this->search({clicks[0], clicks[2]}, third);
  EXPECT_EQ(other->before, first);
}

TYPED_TEST(ClickSearches, DoesNotDependOnTheNumberOfThreads) {
  constexpr int Dim = TypeParam::value;
  const std::vector<Click<Dim>> clicks = {this->inside(14), this->inside(34), this->outside(24)};
  std::vector<NodeSet<Dim>> found;
  for (const int n : {1, 3}) {
    const ThreadLimit limit(n);
    found.push_back(this->search(clicks)->inside());
  }
  EXPECT_EQ(found[0], found[1]);
}

// Two balls, and a click in the noise far from both, where nothing stands out.
TYPED_TEST(ClickSearches, BeginsAnewWhereNothingWasFound) {
  constexpr int Dim = TypeParam::value;
  const test::ClickImage<Dim> balls([](const Vector<Dim>& x) {
    return test::is_in_ball<Dim>(x, test::point<Dim>(14), 9) ||
           test::is_in_ball<Dim>(x, test::point<Dim>(34), 9);
  });
  const auto search = [&](const std::vector<Click<Dim>>& clicks,
                          ClickSearchPointer<Dim> known = nullptr) {
    return search_clicks<Dim>(balls.grid, clicks, std::move(known));
  };
  const Click<Dim> nowhere{test::point<Dim>(24, 2, 2), Side::kInside};
  const auto nothing = search({nowhere});
  ASSERT_TRUE(nothing);
  ASSERT_TRUE(nothing->found.empty());
  const std::vector<Click<Dim>> clicks = {nowhere, test::inside<Dim>(14)};
  const auto found = search(clicks, nothing);
  ASSERT_TRUE(found && !found->found.empty());
  EXPECT_EQ(found->clicks, clicks);
  EXPECT_EQ(found->before, nothing);
  const NodeSet<Dim> ball =
      balls.nodes([](const auto& x) { return test::is_in_ball<Dim>(x, test::point<Dim>(14), 9); });
  EXPECT_GT(balls.covered(ball, found->inside()), 0.9);
  EXPECT_EQ(search(clicks)->inside(), found->inside());
  // A third one goes on from there; without the first one there is the ball alone.
  const auto third = search({clicks[0], clicks[1], test::inside<Dim>(34)}, found);
  EXPECT_EQ(third->before, found);
  // It is judged: the click in the noise has changed little, but what was found before it is none.
  EXPECT_GT(third->inside().count(), found->inside().count());
  EXPECT_FALSE(third->says_little);
  EXPECT_TRUE(third->consent);
}

// A darker ball in a large one, whose end lies beyond the surroundings of the former and the click:
// the second click is looked for as a first one, and its region has both.
TYPED_TEST(ClickSearches, LooksForTheSecondAnewWhereTheFirstHasFoundAPart) {
  constexpr int Dim = TypeParam::value;
  constexpr int kSize = Dim == 2 ? 144 : 72;
  const double radius = 0.38 * kSize, middle = 0.5 * kSize, first = middle - radius / 2;
  const auto at = [&](double x) { return test::point<Dim>(x, middle, middle); };
  const test::LatticeImage<Dim> balls = test::image_of<Dim>(
      [&](const Vector<Dim>& x) {
        if (test::is_in_ball<Dim>(x, at(first), 5)) return 0.55;
        return test::is_in_ball<Dim>(x, at(middle), radius) ? 1.0 : 0.0;
      },
      0.06, kSize);
  const SearchGrid<Dim> grid(balls, balls.extent(), {balls.extent(), 1.5e6});
  const Click<Dim> in_small{at(first), Side::kInside},
      in_large{at(middle + radius / 2), Side::kInside};
  const std::vector<Click<Dim>> clicks = {in_small, in_large};
  const auto part = search_clicks<Dim>(grid, std::vector<Click<Dim>>{in_small});
  ASSERT_TRUE(part && !part->found.empty());
  const double whole = nodes_of_ball<Dim>(radius), small = nodes_of_ball<Dim>(5);
  EXPECT_LT(double(part->inside().count()), 2 * small);
  const auto found = search_clicks<Dim>(grid, clicks, part);
  ASSERT_TRUE(found && !found->found.empty());
  EXPECT_NEAR(double(found->inside().count()), whole, 0.1 * whole);
  EXPECT_EQ(found->clicks, clicks);
  EXPECT_EQ(found->before, part);
  EXPECT_EQ(search_clicks<Dim>(grid, clicks)->inside(), found->inside());
}

TYPED_TEST(ClickSearches, BeginsWithTheFirstInsideClick) {
  const auto found = this->search({this->outside(34), this->inside(14)});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->inside(), this->search({this->inside(14), this->outside(34)})->inside());
  EXPECT_FALSE(this->search({this->outside(34)}));
}

TYPED_TEST(ClickSearches, AClickThatIsWhereItBelongsChangesNothing) {
  const auto first = this->search({this->inside(14)});
  const auto second = this->search({this->inside(14), this->inside(16)}, first);
  EXPECT_EQ(second->inside(), first->inside());
  EXPECT_EQ(second->clicks.size(), 2u);
}

// An outside click a node within the boundary may bring nothing: what was found before stays, for
// those that follow as well.
// How candidates for a crumb agree says nothing of the rest.
TYPED_TEST(ClickSearches, ASmallChangeIsNotJudged) {
  constexpr int Dim = TypeParam::value;
  std::vector<Click<Dim>> clicks = {this->inside(14), this->inside(34)};
  const auto large = this->search(clicks);
  ASSERT_TRUE(large->consent);
  EXPECT_FALSE(large->says_little);
  clicks.push_back(this->outside(42));  // the outermost of the second ball
  const auto small = this->search(clicks, large);
  EXPECT_NE(small->inside(), large->inside());
  EXPECT_GT(this->dice(small->inside(), large->inside()), 0.9);
  EXPECT_TRUE(small->says_little);
  EXPECT_EQ(small->consent, large->consent);
  EXPECT_EQ(small->found.front().kept, large->found.front().kept);
  clicks.push_back(this->outside(34));  // all of that ball
  const auto again = this->search(clicks, small);
  EXPECT_LT(this->dice(again->inside(), small->inside()), 0.9);
  EXPECT_FALSE(again->says_little);
}

TYPED_TEST(ClickSearches, AClickOfWhichNothingComesLeavesWhatWasFound) {
  constexpr int Dim = TypeParam::value;
  const test::ClickImage<Dim> ball(
      [](const Vector<Dim>& x) { return test::is_in_ball<Dim>(x, test::point<Dim>(24), 12); }, 0);
  const auto search = [&](const std::vector<Click<Dim>>& clicks,
                          ClickSearchPointer<Dim> known = nullptr) {
    return search_clicks<Dim>(ball.grid, clicks, std::move(known));
  };
  std::vector<Click<Dim>> clicks = {test::inside<Dim>(24)};
  ClickSearchPointer<Dim> known = search(clicks);
  ASSERT_FALSE(known->found.empty());
  int n_nothing = 0;
  for (const double x : {14.0, 13.0, 12.5, 35.0, 36.0}) {
    clicks.push_back(test::outside<Dim>(x));
    const NodeSet<Dim> before = known->inside();
    known = search(clicks, known);
    ASSERT_FALSE(known->found.empty()) << x;
    n_nothing += known->inside() == before;
    EXPECT_EQ(search(clicks)->inside(), known->inside()) << x;
  }
  EXPECT_GT(n_nothing, 0);
}

TYPED_TEST(ClickSearches, TakesAnotherThatWasFound) {
  const auto found = this->search({this->inside(14), this->inside(34)});
  ASSERT_GT(found->found.size(), 1u);
  const auto other = with_choice(*found, 1);
  EXPECT_EQ(other->chosen, 1u);
  EXPECT_NE(other->inside(), found->inside());
  EXPECT_EQ(with_choice(*other, 0)->inside(), found->inside());
}

// A part of the object that the evolution has lost, and that the region has.
TYPED_TEST(ClickSearches, CorrectsWhatHasEvolved) {
  constexpr int Dim = TypeParam::value;
  const auto found = this->search({this->inside(14)});
  NodeSet<Dim> lost = found->inside();
  const int end = this->image.grid.box().size[0];
  lost.erase_layers(0, 14, end);
  const auto evolved = with_evolved<Dim>(found, lost);
  EXPECT_EQ(evolved->inside(), lost);
  EXPECT_EQ(before_evolutions<Dim>(evolved), found);
  EXPECT_EQ(with_choice(*evolved, 0)->inside(), lost);  // it is what there is now
  const std::vector<Click<Dim>> clicks = {this->inside(14), this->inside(17)};
  EXPECT_EQ(this->search(clicks, found)->inside(), found->inside());  // has it already
  const auto mended = this->search(clicks, evolved);
  EXPECT_FALSE(mended->has_evolved);
  EXPECT_GT(this->dice(mended->inside(), found->inside()), this->dice(lost, found->inside()) + 0.1);
  EXPECT_EQ(before_evolutions<Dim>(mended), found);
}

TYPED_TEST(ClickSearches, EndsWithNothingWhenItIsStopped) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(this->search({this->inside(14)}, nullptr, stop.get_token()));
  const auto first = this->search({this->inside(14)});
  EXPECT_FALSE(this->search({this->inside(14), this->inside(34)}, first, stop.get_token()));
}

}  // namespace
}  // namespace surf::segment
