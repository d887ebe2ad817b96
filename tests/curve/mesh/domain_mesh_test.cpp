#include "libcurve/mesh/domain_mesh.h"

#include <cmath>
#include <numbers>

#include "libcurve/mesh/mesh_motion.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "libsurf/base/random.h"
#include "tests/curve/analytic_fields.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

/// A disc, and beside it a ring with a disc in its hole.
Segments nested() {
  return joined({circle({-1, 0}, 0.6, 0.1), circle({0.9, 0}, 0.9, 0.1),
                 flipped(circle({0.9, 0}, 0.6, 0.1)), circle({0.9, 0.1}, 0.3, 0.1)});
}

double area(const DomainMesh& mesh, bool is_inside) {
  double sum = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Vector<2> p = mesh.points.row(mesh.triangles(t, 0)),
                    a = mesh.points.row(mesh.triangles(t, 1)).transpose() - p,
                    b = mesh.points.row(mesh.triangles(t, 2)).transpose() - p;
    const double twice = a[0] * b[1] - a[1] * b[0];
    EXPECT_GT(twice, 0);
    if (bool(mesh.is_inside[t]) == is_inside) sum += twice / 2;
  }
  return sum;
}

TEST(DomainMesh, BothSidesHaveTheAreasThatTheCurvesPart) {
  const Segments curves = nested();
  const DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), 0.4, 0.1));
  constexpr double kTolerance = 1e-12;
  EXPECT_NEAR(area(mesh, true), enclosed(curves), kTolerance);
  EXPECT_NEAR(area(mesh, false), 16 - enclosed(curves), kTolerance);
}

TEST(DomainMesh, TraceCoversEveryElementFromStartToEnd) {
  const Segments curves = nested();
  const DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), 0.05, 0.1));
  EXPECT_GT(mesh.trace.size(), std::size_t(curves.elements.rows()));  // elements were split
  int element = -1;
  double at = 1;
  for (const TraceEdge& edge : mesh.trace) {
    if (at == 1) {
      ++element;
      at = 0;
      EXPECT_EQ(edge.start, curves.elements(element, 0));
    }
    EXPECT_EQ(edge.element, element);
    EXPECT_EQ(edge.from, at);
    EXPECT_GT(edge.to, at);
    at = edge.to;
    if (at == 1) {
      EXPECT_EQ(edge.end, curves.elements(element, 1));
    }
    EXPECT_TRUE(mesh.is_inside[edge.inside]);
    EXPECT_FALSE(mesh.is_inside[edge.outside]);
  }
  EXPECT_EQ(element + 1, curves.elements.rows());
  EXPECT_EQ(at, 1);
  EXPECT_EQ(mesh.points.topRows(curves.points.rows()), curves.points);
}

TEST(DomainMesh, AnglesAndSizesObeyTheirBounds) {
  SizeField sizes(square(2), 0.5, 0.25);
  sizes.limit({1.6, 1.6}, 0.1);
  const DomainMesh mesh = mesh_domain(nested(), square(2), sizes);
  EXPECT_GT(smallest_angle(mesh), 20);
  for (const auto t : mesh.triangles.rowwise()) {
    const Vector<2> centroid =
        (mesh.points.row(t[0]) + mesh.points.row(t[1]) + mesh.points.row(t[2])) / 3;
    for (int i = 0; i < 3; ++i)
      EXPECT_LE((mesh.points.row(t[i]) - mesh.points.row(t[(i + 1) % 3])).norm(),
                sizes.at(centroid) + 1e-12);
  }
}

TEST(DomainMesh, SizesRiseAgainCheapestFirstWithinTheBudget) {
  SizeField sizes(square(2), 0.5, 0.25);
  const std::array<Vector<2>, 4> places = {{{1.6, 1.6}, {-1.6, 1.6}, {-1.6, -1.6}, {1.6, -1.6}}};
  const double cell = 0.25 * 0.25;
  for (int i = 0; i < 4; ++i) sizes.limit(places[i], 0.2, 4 - i);
  sizes.limit(places[3], 0.1, 5);    // a second bound
  sizes.limit(places[2], 0.15, 10);  // not half of the first: the same one
  const DomainMesh mesh = mesh_domain(circle({0, 0}, 0.5, 0.05), square(2), sizes);
  std::vector<char> is_held(mesh.triangles.rows(), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)  // all at the second place
    is_held[t] =
        mesh.points(mesh.triangles(t, 0), 0) < 0 && mesh.points(mesh.triangles(t, 0), 1) > 0;
  EXPECT_EQ(sizes.raise(mesh, is_held, 3.9 * cell), 0);
  EXPECT_EQ(sizes.raise(mesh, is_held, 8.9 * cell), 1);  // the first one, not the fourth as well
  EXPECT_EQ(sizes.at(places[0]), 0.5);
  EXPECT_EQ(sizes.at(places[3]), 0.1);
  EXPECT_EQ(sizes.raise(mesh, is_held, 15 * cell), 2);
  EXPECT_EQ(sizes.at(places[3]), 0.2);
  EXPECT_EQ(sizes.at(places[2]), 0.5);
  EXPECT_EQ(sizes.raise(mesh, is_held, 1 * cell), 1);
  EXPECT_EQ(sizes.at(places[3]), 0.5);
  EXPECT_EQ(sizes.raise(mesh, is_held, 100 * cell), 0);
  EXPECT_EQ(sizes.at(places[1]), 0.2);
}

TEST(DomainMesh, SheetsAThousandthApartAreMeshed) {
  const Segments curves = joined({circle({0, 0}, 1, 0.1), flipped(circle({0.2, 0}, 0.7990, 0.1))});
  const DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), 0.4, 0.1));
  EXPECT_NEAR(area(mesh, true), enclosed(curves), 1e-12);
}

TEST(DomainMesh, NodesOfTheLastMeshServeAgainAndDoNotPileUp) {
  const SizeField sizes(square(2), 0.3, 0.1);
  DomainMesh mesh = mesh_domain(circle({0, 0}, 0.5, 0.05), square(2), sizes);
  for (int k = 1; k <= 40; ++k) {
    const Segments curve = circle({0, 0}, 0.5 + 0.025 * k, 0.05);
    const Points<2> kept = reusable_nodes(mesh, curve, sizes);
    EXPECT_GT(kept.rows(), mesh.points.rows() / 4);
    mesh = mesh_domain(curve, square(2), sizes, kept);
    EXPECT_GT(smallest_angle(mesh), 20);
  }
  const DomainMesh fresh = mesh_domain(circle({0, 0}, 1.5, 0.05), square(2), sizes);
  EXPECT_LT(mesh.points.rows(), 2 * fresh.points.rows());
}

TEST(DomainMesh, CurvesThatMeetOrLeaveTheBoxAreRefused) {
  const SizeField sizes(square(2), 0.4, 0.1);
  for (const Segments& curves :
       {joined({circle({0, 0}, 1, 0.1), circle({1, 0}, 1, 0.1)}), circle({1.5, 0}, 1, 0.1),
        joined({polygon(square(0.5), 1), polygon(square(0.5), 1)})})
    EXPECT_THROW(mesh_domain(curves, square(2), sizes), InvalidMesh);
}

TEST(DomainMesh, TriangleThatContainsAPointIsFound) {
  const DomainMesh mesh = mesh_domain(nested(), square(2), SizeField(square(2), 0.4, 0.1));
  const TriangleFinder find(mesh);
  for (int k = 0; k < 500; ++k) {
    const Vector<2> x(4 * uniform_random(1, 2 * k) - 2, 4 * uniform_random(1, 2 * k + 1) - 2);
    const auto [t, barycentric] = find(x);
    ASSERT_GE(t, 0);
    EXPECT_GE(barycentric.minCoeff(), -1e-12);
    Vector<2> back = Vector<2>::Zero();
    for (int i = 0; i < 3; ++i) back += barycentric[i] * mesh.points.row(mesh.triangles(t, i));
    EXPECT_LT((back - x).norm(), 1e-12);
  }
}

TEST(DomainMesh, TriangleIsFoundForPointsBesideAnObliqueBox) {
  Points<2> diamond(4, 2);
  diamond << 2, 0, 0, 2, -2, 0, 0, -2;
  const DomainMesh mesh =
      mesh_domain(circle({0, 0}, 0.5, 0.1), diamond, SizeField(diamond, 0.3, 0.1));
  const TriangleFinder find(mesh);
  for (const Vector<2>& x : {Vector<2>(1.9, 1.9), Vector<2>(-1.9, 1.8), Vector<2>(-5, -5)}) {
    const int t = find(x).triangle;
    EXPECT_GE(t, 0);
    EXPECT_LT(t, mesh.triangles.rows());
  }
}

TEST(MeshMotion, NodesOnTheCurvesFollowThemAndThoseOnTheBorderStay) {
  const Segments curves = nested();
  const DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), 0.06, 0.1));
  const MeshMotion motion(mesh, curves.elements, curves.points.rows());
  Points<2> shift(curves.points.rows(), 2);
  shift.rowwise() = Eigen::RowVector2d(0.01, -0.02);
  const Points<2> moved = motion.moved(shift);
  for (const TraceEdge& edge : mesh.trace)
    EXPECT_LT((moved.row(edge.end) - mesh.points.row(edge.end) - shift.row(0)).norm(), 1e-14);
  for (Eigen::Index i = 0; i < moved.rows(); ++i)
    if (mesh.is_on_border[i]) {
      EXPECT_EQ(moved.row(i), mesh.points.row(i));
    }
}

TEST(MeshMotion, TransposedMapIsTheTransposed) {
  const Segments curves = nested();
  const DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), 0.2, 0.1));
  const MeshMotion motion(mesh, curves.elements, curves.points.rows());
  Points<2> d(curves.points.rows(), 2), g(mesh.points.rows(), 2);
  for (Eigen::Index i = 0; i < d.size(); ++i) d.data()[i] = normal_random(1, i);
  for (Eigen::Index i = 0; i < g.size(); ++i) g.data()[i] = normal_random(2, i);
  const double there = (motion.moved(d) - mesh.points).cwiseProduct(g).sum();
  constexpr double kTolerance = 1e-10;
  EXPECT_NEAR(there, motion.transposed(g).cwiseProduct(d).sum(), kTolerance * d.norm() * g.norm());
}

}  // namespace
}  // namespace surf::curve
