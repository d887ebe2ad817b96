#include "libsurf/segment/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

template <class T>
struct Pieces : test::DumbbellTest<T> {
  using test::DumbbellTest<T>::kDim;
  const NodeSet<kDim> left = this->ball(14);

  bool holds(const Rung<kDim>& piece, const GridClick<kDim>& click) const {
    return piece.inside.contains(click.seed.nodes.front());
  }
};
TYPED_TEST_SUITE(Pieces, test::Dims, test::DimName);

TYPED_TEST(Pieces, OfAnInsideClickHoldItAndNothingOfTheObject) {
  constexpr int Dim = TypeParam::value;
  const auto scene = this->scene(this->left, {this->inside(14), this->inside(34)});
  const auto found = pieces(scene, {});
  ASSERT_FALSE(found.empty());
  for (const Rung<Dim>& piece : found) {
    EXPECT_TRUE(this->holds(piece, scene.click()));
    EXPECT_EQ(piece.inside.in(scene.box()).count_in_both(this->left), 0u);
  }
}

TYPED_TEST(Pieces, OfAnOutsideClickAreOfTheObjectWithoutItsInsideClicks) {
  constexpr int Dim = TypeParam::value;
  const auto scene = this->scene(this->both, {this->inside(14), this->outside(34)});
  std::set<Family> families;
  for (const Rung<Dim>& piece : pieces(scene, {})) {
    families.insert(piece.family);
    EXPECT_TRUE(this->holds(piece, scene.click()));
    EXPECT_FALSE(this->holds(piece, scene.clicks.front()));
    EXPECT_TRUE((piece.inside.in(scene.box()) - this->both).is_empty());
  }
  for (const Family family : {Family::kNeck, Family::kCompetition, Family::kBall})
    EXPECT_TRUE(families.count(family)) << int(family);
}

TYPED_TEST(Pieces, ANeckPartsTheBalls) {
  constexpr int Dim = TypeParam::value;
  const auto right = this->ball(34);
  const auto scene = this->scene(this->both, {this->inside(14), this->outside(34)});
  double best = 0;
  for (const Rung<Dim>& piece : pieces(scene, {})) {
    if (piece.family != Family::kNeck) continue;
    best = std::max(best, this->dice(piece.inside.in(scene.box()), right));
  }
  EXPECT_GT(best, 0.9);
}

// A shell as bright as what joins it to something larger: no window alone is the shell.
TYPED_TEST(Pieces, AClickInAShellMeansTheShell) {
  constexpr int Dim = TypeParam::value;
  constexpr double kInner = 10, kOuter = 13;
  const auto away = [](const Vector<Dim>& x) { return (x - test::point<Dim>(20)).norm(); };
  const auto is_shell = [&](const Vector<Dim>& x) { return away(x) > kInner && away(x) <= kOuter; };
  const test::ClickImage<Dim> seen([&](const Vector<Dim>& x) {
    return is_shell(x) || (away(x) > kInner && x[0] > 20 && std::abs(x[1] - 24) < 9);
  });
  const auto before = seen.nodes([&](const Vector<Dim>&x) { return away(x) <= kInner; }),
             shell = seen.nodes(is_shell);
  const ClickScene<Dim> scene{
      seen.grid,
      before,
      {seen.on_grid(this->inside(20)), seen.on_grid(this->inside(20 - (kInner + kOuter) / 2))},
      0.03};
  double best = 0;
  for (const Rung<Dim>& piece : pieces(scene, {}))
    best = std::max(best, this->dice(piece.inside.in(scene.box()), shell));
  EXPECT_GT(best, 0.8);
}

TYPED_TEST(Pieces, ClicksHoldTheNodesRoundThem) {
  const auto scene = this->scene(this->both, {this->inside(14), this->outside(15)});
  const auto held = scene.held();
  const auto at = [&](double x) {
    return held[scene.box().at(this->image.on_grid(this->inside(x)).seed.nodes.front())];
  };
  EXPECT_EQ(at(13), Held::kInside);
  EXPECT_EQ(at(14), Held::kInside);  // its own node
  EXPECT_EQ(at(16), Held::kOutside);
  EXPECT_EQ(at(20), Held::kFree);
  const auto domain = scene.domain();
  EXPECT_FALSE(domain.contains(scene.clicks[0].seed.nodes.front()));
  EXPECT_TRUE(domain.contains(scene.click().seed.nodes.front()));
}

}  // namespace
}  // namespace surf::segment
