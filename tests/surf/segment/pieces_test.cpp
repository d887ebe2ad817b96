#include "libsurf/segment/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

template <class T>
struct Pieces : test::DumbbellTest<T> {
  using test::DumbbellTest<T>::kDim;
  const Flags left = this->ball(14);

  bool holds(const Rung<kDim>& piece, const GridClick<kDim>& click) const {
    const auto& node = click.seed.nodes.front();
    return piece.box.contains(node) && piece.inside[piece.box.at(node)];
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
    for (std::size_t at = 0; at < piece.inside.size(); ++at)
      ASSERT_FALSE(piece.inside[at] && this->left[scene.box().at(piece.box.node(at))]);
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
    for (std::size_t at = 0; at < piece.inside.size(); ++at)
      ASSERT_FALSE(piece.inside[at] && !this->both[scene.box().at(piece.box.node(at))]);
  }
  for (const Family family : {Family::kNeck, Family::kCompetition, Family::kBall})
    EXPECT_TRUE(families.count(family)) << int(family);
}

TYPED_TEST(Pieces, ANeckPartsTheBalls) {
  constexpr int Dim = TypeParam::value;
  const Flags right = this->ball(34);
  const auto scene = this->scene(this->both, {this->inside(14), this->outside(34)});
  double best = 0;
  for (const Rung<Dim>& piece : pieces(scene, {})) {
    if (piece.family != Family::kNeck) continue;
    Flags flags(scene.box().n(), 0);
    for (std::size_t at = 0; at < piece.inside.size(); ++at)
      if (piece.inside[at]) flags[scene.box().at(piece.box.node(at))] = 1;
    best = std::max(best, this->dice(flags, right));
  }
  EXPECT_GT(best, 0.9);
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
  const Flags domain = scene.domain();
  EXPECT_EQ(domain[scene.box().at(scene.clicks[0].seed.nodes.front())], 0);
  EXPECT_EQ(domain[scene.box().at(scene.click().seed.nodes.front())], 1);
}

}  // namespace
}  // namespace surf::segment
