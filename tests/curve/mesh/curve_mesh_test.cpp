#include "libcurve/mesh/curve_mesh.h"

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

void check_links(const CurveMesh& curves) {
  for (int i = 0; i < curves.size(); ++i) {
    EXPECT_EQ(curves.prev(curves.next(i)), i);
    EXPECT_EQ(curves.next(curves.prev(i)), i);
  }
}

TEST(CurveMesh, KeepsNodesAndDropsPointsThatNoElementUses) {
  Segments curves{Points<2>(5, 2), Elements<2>(3, 2)};
  curves.points << 9, 9, 0, 0, 1, 0, 8, 8, 0, 1;
  curves.elements << 2, 4, 1, 2, 4, 1;
  const CurveMesh mesh(curves);
  check_links(mesh);
  ASSERT_EQ(mesh.size(), 3);
  EXPECT_EQ(mesh.point(0), Vector<2>(0, 0));
  EXPECT_EQ(mesh.next(0), 1);
  EXPECT_EQ(mesh.next(1), 2);
}

TEST(CurveMesh, SplitsAndRemovesNodes) {
  CurveMesh mesh(joined({circle({0, 0}, 1, 0.7), circle({5, 0}, 1, 0.7)}));
  const int n = mesh.size();
  EXPECT_EQ(mesh.split(3, {7, 7}), n);
  check_links(mesh);
  EXPECT_EQ(mesh.next(3), n);
  EXPECT_EQ(mesh.components()[n], 0);
  std::vector<char> is_gone(mesh.size(), 0);
  is_gone[3] = is_gone[4] = is_gone[n] = 1;
  const std::vector<int> old = mesh.remove(is_gone);
  check_links(mesh);
  EXPECT_EQ(mesh.size(), n - 2);
  EXPECT_EQ(mesh.next(2), 3);
  EXPECT_EQ(old[3], 5);
  // All but two nodes of a component: it goes.
  is_gone.assign(mesh.size(), 0);
  for (int i = 2; i < 7; ++i) is_gone[i] = mesh.components()[i] == 0;
  mesh.remove(is_gone);
  check_links(mesh);
  EXPECT_EQ(mesh.components().back(), 0);
}

TEST(CurveMesh, RefusesOpenAndBranchingCurves) {
  Segments open{Points<2>::Random(3, 2), Elements<2>(2, 2)};
  open.elements << 0, 1, 1, 2;
  EXPECT_THROW(CurveMesh{open}, InvalidMesh);
  Segments branching{Points<2>::Random(3, 2), Elements<2>(4, 2)};
  branching.elements << 0, 1, 1, 0, 0, 2, 2, 0;
  EXPECT_THROW(CurveMesh{branching}, InvalidMesh);
}

}  // namespace
}  // namespace surf::curve
