#include "libsurf/segment/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/surf/fixtures.h"
#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

using test::ClickImage;
using test::inside;
using test::outside;

VerdictFeatures good() {
  return {.separation = 0.95, .border_share = 0, .kept = 0.97, .consent = {}};
}

TEST(Verdict, ConsentIsTheMeanOverlapByScores) {
  EXPECT_EQ(consent_of(std::array{3.0}, std::array{1.0}), 1);
  EXPECT_DOUBLE_EQ(consent_of(std::array{2.0, 1.0, 1.0}, std::array{1.0, 0.9, 0.1}), 0.75);
}

TEST(Verdict, FallsWithWhatSpeaksAgainst) {
  const double best = likelihood_of_right(good());
  EXPECT_GT(best, 0.9);
  VerdictFeatures moved = good();
  moved.kept = 0.6;
  EXPECT_LT(likelihood_of_right(moved), best);
  EXPECT_THAT(doubt(moved), ::testing::HasSubstr("edges near by"));
  VerdictFeatures faint = good();
  faint.separation = 0.2;
  EXPECT_LT(likelihood_of_right(faint), best);
  EXPECT_THAT(doubt(faint), ::testing::HasSubstr("alike"));
}

TEST(Verdict, DoubtsACorrectionFromWhichOthersDiffer) {
  VerdictFeatures corrected = good();
  corrected.consent = 1;
  const double best = likelihood_of_right(corrected);
  EXPECT_GE(best, likelihood_of_right(good()));
  corrected.consent = 0.6;
  EXPECT_LT(likelihood_of_right(corrected), best);
  EXPECT_THAT(doubt(corrected), ::testing::HasSubstr("other corrections"));
  VerdictFeatures first = corrected;
  first.consent.reset();
  EXPECT_EQ(likelihood_of_right(first), likelihood_of_right(good()));
  EXPECT_THAT(doubt(first), ::testing::HasSubstr("little"));
}

/// Saying the same again is no reason to trust it more.
TEST(Verdict, StaysWhereAFurtherClickChangesNothing) {
  const ClickImage<3> image(test::is_in_dumbbell<3>);
  const auto features = [&](const std::vector<Click<3>>& clicks) {
    return verdict_features(image.grid, *search_clicks<3>(image.grid, clicks));
  };
  const double first = likelihood_of_right(features({inside<3>(14)}));
  EXPECT_EQ(likelihood_of_right(features({inside<3>(14), inside<3>(15)})), first);
}

/// What a click at `click` on the first axis finds of a ball about x.
struct FoundBall {
  FoundBall(double x, double radius, double click)
      : image([=](const Vector<3>& at) {
          return test::is_in_ball<3>(at, test::point<3>(x), radius);
        }),
        search(search_clicks<3>(image.grid, std::vector{inside<3>(click)})) {}

  bool is_found() const { return search && !search->found.empty(); }
  VerdictFeatures features() const { return verdict_features(image.grid, *search); }

  ClickImage<3> image;
  ClickSearchPointer<3> search;
};

TEST(Verdict, IsNotGivenWhereAnotherThanTheBestWasChosenBefore) {
  const ClickImage<3> image(test::is_in_dumbbell<3>);
  const auto found = search_clicks<3>(image.grid, std::vector{inside<3>(14), inside<3>(34)});
  ASSERT_GT(found->found.size(), 1u);
  EXPECT_TRUE(verdict(image.grid, *found));
  const auto other = with_choice(*found, 1);
  EXPECT_FALSE(verdict(image.grid, *other));
  ClickSearch<3> further = *other;  // a click that says little of it
  further.before = other;
  further.chosen = 0;
  further.says_little = true;
  EXPECT_FALSE(verdict(image.grid, further));
  further.says_little = false;  // and one that says much
  EXPECT_TRUE(verdict(image.grid, further));
}

// A leak that fills the image has its deepest place anywhere.
TEST(Verdict, LooksNearTheRegionWhereAnotherGoesOnBeyond) {
  const FoundBall ball(16, 6, 16);
  ASSERT_TRUE(ball.is_found());
  ClickSearch<3> torn = *ball.search;
  torn.chosen = 0;
  torn.found.resize(1);
  Rung<3> leak = torn.found.front();
  leak.inside = NodeSet<3>(ball.image.grid.box()).complement();
  leak.score *= 0.9;
  torn.found.push_back(leak);
  const auto found = verdict(ball.image.grid, torn);
  ASSERT_TRUE(found);
  const double away = (found->place_mm - test::point<3>(16)).norm();
  EXPECT_GT(away, 6);
  EXPECT_LT(away, 6 + 5 + 1.5);
}

TEST(Verdict, TrustsABallThatStandsOut) {
  const FoundBall ball(24, 12, 24);
  ASSERT_TRUE(ball.is_found());
  const VerdictFeatures features = ball.features();
  EXPECT_GT(features.separation, 0.9);
  EXPECT_EQ(features.border_share, 0);
  EXPECT_FALSE(features.consent);
  const auto found = verdict(ball.image.grid, *ball.search);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->trust, Trust::kTrusted) << found->text();
  EXPECT_GT(found->n_cases, 20);
  EXPECT_GE(found->n_right, 0.9 * found->n_cases);
}

TEST(Verdict, DoesNotTrustASurfaceWithoutEdges) {
  const FoundBall ball(24, 12, 24);
  auto found = verdict(ball.image.grid, *ball.search);
  ASSERT_TRUE(found);
  Certainty<3> certainty;
  certainty.next_click_mm = {1, 2, 3};
  certainty.share_without_edge = 0.4;
  found->heed(certainty);
  EXPECT_EQ(found->trust, Trust::kTrusted);
  certainty.share_without_edge = 0.99;
  found->heed(certainty);
  EXPECT_EQ(found->trust, Trust::kCheck);
  EXPECT_NE(found->text().find("along 99 % of it no edge is found"), std::string::npos);
  EXPECT_LT(found->n_right, 0.9 * found->n_cases);
  EXPECT_EQ(found->place_mm, *certainty.next_click_mm);
}

// The same ball, cut in half by the border of the volume.
TEST(Verdict, DoesNotTrustWhatTheBorderCutsOff) {
  const FoundBall ball(0, 14, 6);
  ASSERT_TRUE(ball.is_found());
  EXPECT_GT(ball.features().border_share, 0.1);
  const auto found = verdict(ball.image.grid, *ball.search);
  ASSERT_TRUE(found);
  EXPECT_NE(found->trust, Trust::kTrusted) << found->text();
}

TEST(Verdict, DoubtsWhatTheBorderCutsOffOverNearlyHalfOfItsBoundary) {
  const FoundBall ball(-9, 17, 4);
  ASSERT_TRUE(ball.is_found());
  EXPECT_GT(ball.features().border_share, 0.3);
  const auto found = verdict(ball.image.grid, *ball.search);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->trust, Trust::kDoubtful);
  EXPECT_NE(found->text().find("the border of the volume cuts it off"), std::string::npos)
      << found->text();
}

// A click in the air, which is heeded after the one that finds the ball.
TEST(Verdict, DoesNotTrustWhereNothingStandsOutRoundOneOfTheClicks) {
  const FoundBall in_the_air(24, 12, 2), ball(24, 12, 24);
  ASSERT_FALSE(in_the_air.is_found());
  const auto search = search_clicks<3>(ball.image.grid, std::vector{inside<3>(2), inside<3>(24)});
  ASSERT_TRUE(search);
  ASSERT_FALSE(search->found.empty());
  const auto found = verdict(ball.image.grid, *search);
  ASSERT_TRUE(found);
  EXPECT_NE(found->trust, Trust::kTrusted) << found->text();
}

// Two balls and a bridge: one object, or two.
TEST(Verdict, LooksWhereAnotherRegionDiffers) {
  const ClickImage<3> image(test::is_in_dumbbell<3>);
  const std::vector<Click<3>> clicks = {inside<3>(14)};
  const auto search = search_clicks<3>(image.grid, clicks);
  ASSERT_TRUE(search && search->found.size() > 1);
  const auto found = verdict(image.grid, *search);
  ASSERT_TRUE(found);
  // One of the balls is in dispute.
  const double to_balls = std::min((found->place_mm - test::point<3>(14)).norm(),
                                   (found->place_mm - test::point<3>(34)).norm());
  EXPECT_LT(to_balls, 6);
  EXPECT_THAT(found->text(), ::testing::HasSubstr("such cases"));
  // What a person has chosen is not judged.
  EXPECT_FALSE(verdict(image.grid, *with_choice(*search, 1)));
}

TEST(Verdict, IsNotGivenInThePlane) {
  const ClickImage<2> image(test::is_in_dumbbell<2>);
  const std::vector<Click<2>> clicks = {inside<2>(14)};
  EXPECT_FALSE(verdict(image.grid, *search_clicks<2>(image.grid, clicks)));
}

}  // namespace
}  // namespace surf::segment
