#include "libcurve/mesh/primitives.h"

#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve {
namespace {

fem::Geometry<2> geometry(const Segments& curves) { return {curves.points, curves.elements}; }

TEST(CurvePrimitives, CircleHasItsNodesOnTheCircleAndElementsWithinTheWantedLength) {
  for (const double edge_length : {5.0, 0.5, 0.01}) {
    const Segments curves = circle({10, -20}, 2, edge_length);
    const Eigen::VectorXd radii =
        (curves.points.rowwise() - Eigen::RowVector2d(10, -20)).rowwise().norm();
    EXPECT_NEAR(radii.minCoeff(), 2, 1e-14 * 20);
    EXPECT_NEAR(radii.maxCoeff(), 2, 1e-14 * 20);
    EXPECT_LE(geometry(curves).measures().maxCoeff(), edge_length * (1 + 1e-9));
    // Area of the regular polygon.
    const double n = double(curves.elements.rows());
    EXPECT_NEAR(geometry(curves).enclosed(), 2 * n * std::sin(2 * std::numbers::pi / n), 1e-11);
  }
}

TEST(CurvePrimitives, MirroredEllipseIsCounterClockwiseToo) {
  Eigen::Matrix2d axes;
  axes << 3, 1, 0, -1;
  const Segments curves = ellipse({1, 1}, axes, 0.01);
  EXPECT_NEAR(geometry(curves).enclosed(), 3 * std::numbers::pi, 1e-4);
  EXPECT_LE(geometry(curves).measures().maxCoeff(), 0.01 * (1 + 1e-9));
  EXPECT_NEAR(geometry(flipped(curves)).enclosed(), -3 * std::numbers::pi, 1e-4);
}

TEST(CurvePrimitives, PolygonKeepsItsCornersAndCutsItsSides) {
  Points<2> corners(3, 2);
  corners << 0, 0, 1, 0, 0, 1;
  const Segments curves = polygon(corners, 0.5);
  EXPECT_EQ(curves.points.rows(), 2 + 3 + 2);
  EXPECT_NEAR(geometry(curves).enclosed(), 0.5, 1e-15);
}

TEST(CurvePrimitives, GridOfCirclesFillsTheBox) {
  const Segments curves = grid_of_circles({0, 0}, {3, 2}, 1, 0.3, 0.01);
  EXPECT_NEAR(geometry(curves).enclosed(), 6 * 0.09 * std::numbers::pi, 1e-3);
  EXPECT_LT(curves.points.col(0).maxCoeff(), 2.81);
}

TEST(CurvePrimitives, RefuseWhatIsNoShape) {
  EXPECT_THROW(circle({0, 0}, 0, 1), UsageError);
  EXPECT_THROW(circle({0, 0}, 1, 0), UsageError);
  EXPECT_THROW(circle({0, 0}, 1, 1e-9), UsageError);
  EXPECT_THROW(ellipse({0, 0}, Eigen::Matrix2d::Ones(), 1), UsageError);
  EXPECT_THROW(polygon(Points<2>::Zero(2, 2), 1), UsageError);
}

}  // namespace
}  // namespace surf::curve
