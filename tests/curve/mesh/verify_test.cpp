#include "libcurve/mesh/verify.h"

#include "libcurve/mesh/primitives.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

Segments disc(double x, double radius) { return circle({x, 0}, radius, 0.1); }

TEST(CurveVerify, PassesSimpleClosedAlternatingCurves) {
  const Verification result =
      verify(joined({disc(0, 3), flipped(disc(0, 2)), disc(0, 1), disc(10, 1)}));
  EXPECT_TRUE(result.passed());
  EXPECT_EQ(result.n_components, 4);
  EXPECT_EQ(result.message().substr(0, 27), "closed, simple, alternating");
}

TEST(CurveVerify, NamesWhatIsWrong) {
  EXPECT_EQ(verify(Segments()).message(), "no elements");
  Segments open = disc(0, 1);
  open.elements.conservativeResize(open.elements.rows() - 1, 2);
  EXPECT_EQ(verify(open).n_open_nodes, 2);
  EXPECT_EQ(verify(joined({disc(0, 1), disc(1.5, 1)})).n_intersections, 2);
  EXPECT_EQ(verify(joined({disc(0, 2), disc(0, 1)})).n_misoriented_components, 1);
  EXPECT_EQ(verify(flipped(disc(0, 1))).n_misoriented_components, 1);
  Segments missing = disc(0, 1);
  missing.elements(3, 1) = 1000;
  EXPECT_EQ(verify(missing).n_invalid, 1);
  EXPECT_FALSE(verify(missing).passed());
}

TEST(CurveVerify, FindsTouchesFoldsAndElementsWithoutLength) {
  Points<2> touching(8, 2);  // a node on another element
  touching << 0, 0, 2, 0, 2, 2, 1.5, 2, 1, 0, 0.5, 2, 0, 2, 0, 1;
  EXPECT_EQ(verify(polygon(touching, 10)).n_intersections, 2);
  Points<2> spike(4, 2);
  spike << 0, 0, 1, 0, 2, 0, 1, 1;
  spike.row(2) << 0.5, 0;
  EXPECT_GE(verify(polygon(spike, 10)).n_intersections, 1);
  Segments repeated = disc(0, 1);
  repeated.points.row(1) = repeated.points.row(0);
  EXPECT_EQ(verify(repeated).n_degenerate, 1);
  EXPECT_FALSE(verify(repeated).simple);
}

}  // namespace
}  // namespace surf::curve
