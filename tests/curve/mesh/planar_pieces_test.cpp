#include "libcurve/mesh/detail/planar_pieces.h"

#include <gtest/gtest.h>

#include "libcurve/mesh/primitives.h"

namespace surf::curve {
namespace {

Segments square(double x, double y, double side) {
  Points<2> corners(4, 2);
  corners << x, y, x + side, y, x + side, y + side, x, y + side;
  return polygon(corners, side);
}

struct Meeting {
  Segments curves;
  std::vector<ElementPair> pairs = intersections(curves.points, curves.elements);
  PlanarPieces graph{curves, pairs, static_cast<int>(curves.elements.rows())};
};

TEST(PlanarPieces, AreTheElementsWhereNothingMeets) {
  const Meeting apart{joined({square(0, 0, 1), square(5, 0, 1)})};
  ASSERT_EQ(apart.graph.pieces().size(), 8u);
  for (const Piece& piece : apart.graph.pieces()) {
    EXPECT_TRUE(piece.is_whole && piece.is_real);
    EXPECT_EQ(piece.winding, 1);
  }
  EXPECT_EQ(apart.graph.n_vertices(), 8);
}

TEST(PlanarPieces, OfTwoSquaresThatOverlapAreSplitAtTheirTwoCrossings) {
  const Meeting two{joined({square(0, 0, 2), square(1, 1, 2)})};
  EXPECT_EQ(two.graph.n_vertices(), 8 + 2);
  EXPECT_EQ(two.graph.pieces().size(), 8u + 4);
  std::vector<Vector<2>> crossings = {two.graph.rounded(8), two.graph.rounded(9)};
  if (crossings[0][0] > crossings[1][0]) std::swap(crossings[0], crossings[1]);
  EXPECT_EQ(crossings[0], Vector<2>(1, 2));
  EXPECT_EQ(crossings[1], Vector<2>(2, 1));
  for (int e = 0; e < 8; ++e) {
    const bool is_split = two.graph.along(e).size() == 2;
    EXPECT_TRUE(is_split || two.graph.along(e).size() == 1) << e;
    for (const int piece : two.graph.along(e))
      EXPECT_EQ(two.graph.pieces()[piece].is_whole, !is_split) << e;
  }
}

TEST(PlanarPieces, OfEqualCurvesAreAddedUpAndOfOppositeOnesCancel) {
  const Meeting equal{joined({square(0, 0, 1), square(0, 0, 1)})};
  ASSERT_EQ(equal.graph.pieces().size(), 4u);
  for (const Piece& piece : equal.graph.pieces()) EXPECT_EQ(piece.winding, 2);
  const Meeting opposite{joined({square(0, 0, 1), flipped(square(0, 0, 1))})};
  EXPECT_TRUE(opposite.graph.pieces().empty());
  EXPECT_EQ(opposite.graph.along(0)[0], -1);
}

}  // namespace
}  // namespace surf::curve
