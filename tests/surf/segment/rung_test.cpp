#include "libsurf/segment/rung.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/surf/fixtures.h"

namespace surf::segment {
namespace {

template <class T>
struct Rungs : ::testing::Test {
  static constexpr int kDim = T::value;
  static NodeBox<kDim> box() { return NodeBox<kDim>::cube(4, 33); }
  /// Round the node `from_middle` off the middle along the first axis.
  static Flags ball(double r, int from_middle = 0) {
    Flags out(box().n());
    for (std::size_t at = 0; at < out.size(); ++at) {
      double squared = 0;
      for (int axis = 0; axis < kDim; ++axis)
        squared += std::pow(box().node(at)[axis] - 20 - (axis == 0) * from_middle, 2);
      out[at] = squared < r * r;
    }
    return out;
  }
  /// Measured where the nodes within `bright` are bright and those on its edge are edges.
  static Rung<kDim> measured(const Flags& inside, const Flags& bright, const Flags& edge) {
    std::vector<std::uint16_t> level(inside.size());
    for (std::size_t at = 0; at < level.size(); ++at) level[at] = bright[at] ? 9000 : 3000;
    Rung<kDim> out;
    out.inside = {box(), inside};
    measure(box(), level, {box(), edge}, out);
    return out;
  }
  static Rung<kDim> measured(const Flags& inside) {
    return measured(inside, inside, Flags(inside.size(), 1));
  }
};
TYPED_TEST_SUITE(Rungs, test::Dims, test::DimName);

TYPED_TEST(Rungs, KnowABallForOne) {
  const auto rung = this->measured(this->ball(12));
  EXPECT_EQ(rung.n_nodes, rung.inside.count());
  EXPECT_DOUBLE_EQ(rung.features.separation, 1);
  EXPECT_DOUBLE_EQ(rung.features.edge_share, 1);
  EXPECT_NEAR(rung.features.sphericity, 1, 0.05);  // the count of faces is exact in the mean only
  EXPECT_EQ(rung.border_share, 0);
}

TYPED_TEST(Rungs, SeeThatABoundaryLiesBesideTheEdge) {
  const Flags bright = this->ball(9);
  Flags edge = this->ball(9.7);
  for (std::size_t at = 0; at < edge.size(); ++at) edge[at] = edge[at] && !bright[at];
  const auto right = this->measured(bright, bright, edge),
             wrong = this->measured(this->ball(12), bright, edge);
  EXPECT_GT(right.features.edge_share, 0.8);
  EXPECT_EQ(wrong.features.edge_share, 0);
  EXPECT_LT(wrong.features.separation, right.features.separation);
  EXPECT_LT(settled_score(wrong, 1), settled_score(right, 1));
}

TYPED_TEST(Rungs, CountWhatTheBorderCutsOff) {
  const auto whole = this->measured(this->ball(10)), cut = this->measured(this->ball(10, 16));
  EXPECT_GT(cut.border_share, 0.2);
  EXPECT_LT(ladder_score(cut), ladder_score(whole));
  EXPECT_LT(settled_score(cut, 1), settled_score(whole, 1));
}

TYPED_TEST(Rungs, CountLessWhereTheSeedsAreShallow) {
  const auto rung = this->measured(this->ball(10));
  EXPECT_LT(settled_score(rung, 0.3), settled_score(rung, 0.9));
}

TYPED_TEST(Rungs, OverlapByDice) {
  const auto a = this->measured(this->ball(8)), b = this->measured(this->ball(11)),
             c = this->measured(this->ball(3, 12));
  EXPECT_DOUBLE_EQ(overlap(a, a), 1);
  EXPECT_DOUBLE_EQ(overlap(a, b), 2.0 * double(a.n_nodes) / double(a.n_nodes + b.n_nodes));
  EXPECT_EQ(overlap(a, c), 0);
}

TYPED_TEST(Rungs, ScoreNothingIfEmpty) {
  EXPECT_EQ(settled_score(this->measured(Flags(this->box().n(), 0)), 1), 0);
}

}  // namespace
}  // namespace surf::segment
