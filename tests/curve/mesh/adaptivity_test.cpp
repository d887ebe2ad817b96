#include "libcurve/mesh/adaptivity.h"

#include <Eigen/Geometry>
#include <random>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

fem::Geometry<2> geometry(const CurveMesh& curves) { return {curves.points(), curves.elements()}; }

TEST(CurveAdaptivity, BringsTheGeometricVariationBelowItsToleranceAndSettles) {
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    CurveMesh curves(circle({0, 0}, 1, 0.5));
    AdaptivityOptions options;
    options.geometry_tolerance_mm = tolerance;
    options.max_length_mm = 10;
    const AdaptivityReport report = adapt(curves, options);
    EXPECT_TRUE(report.is_settled);
    EXPECT_LE(fem::geometric_variation(geometry(curves)).maxCoeff(), tolerance);
    // On a circle eta = 2 h^2 / r: bisection ends at most a factor of two below.
    EXPECT_LE(double(curves.size()), 2.2 * 2 * M_PI / std::sqrt(tolerance / 2));
  }
}

TEST(CurveAdaptivity, CoarsensWhatIsTooFineWithoutLeavingTheTolerance) {
  CurveMesh curves(circle({0, 0}, 1, 0.001));
  AdaptivityOptions options;
  options.geometry_tolerance_mm = 0.02;
  options.max_length_mm = 10;
  const AdaptivityReport report = adapt(curves, options);
  EXPECT_TRUE(report.is_settled);
  EXPECT_LT(curves.size(), 120);
  EXPECT_LE(fem::geometric_variation(geometry(curves)).maxCoeff(), 0.02);
  expect_valid(curves.segments());
}

TEST(CurveAdaptivity, StopsRefiningAtTheLimitAndSaysSo) {
  CurveMesh curves(circle({0, 0}, 1, 0.5));
  AdaptivityOptions options;
  options.max_length_mm = 1e-3;
  options.max_elements = 100;
  EXPECT_TRUE(adapt(curves, options).is_limited);
  EXPECT_LE(curves.size(), 100);
}

TEST(CurveAdaptivity, SmoothingKeepsTheAreaOfEveryComponentAndEvensTheLengths) {
  Segments uneven = joined({circle({0, 0}, 2, 0.1), flipped(circle({0.3, 0}, 1, 0.1))});
  // Nodes pushed along the circles.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-0.02, 0.02);
  for (Eigen::Index i = 0; i < uneven.points.rows(); ++i) {
    const Vector<2> centre =
        i < circle({0, 0}, 2, 0.1).points.rows() ? Vector<2>(0, 0) : Vector<2>(0.3, 0);
    uneven.points.row(i) =
        centre + Eigen::Rotation2Dd(angle(random)) * (uneven.points.row(i).transpose() - centre);
  }
  CurveMesh curves(uneven);
  const auto before = curve_hierarchy(curves.segments()).components;
  const auto ratio = [&] {
    const Eigen::VectorXd h = geometry(curves).measures();
    return h.maxCoeff() / h.minCoeff();
  };
  const double uneven_ratio = ratio();
  smooth(curves, {.n_sweeps = 20});
  const auto after = curve_hierarchy(curves.segments()).components;
  for (int part : {0, 1})
    EXPECT_NEAR(after[part].area_mm2, before[part].area_mm2, 1e-13 * curves.size());
  EXPECT_LT(ratio() - 1, 0.3 * (uneven_ratio - 1));
  expect_valid(curves.segments());
}

TEST(CurveAdaptivity, RemovesShortElementsButNoCorners) {
  Points<2> corners(5, 2);
  corners << 0, 0, 1, 0, 1.01, 0, 1.01, 1, 0, 1;
  CurveMesh curves(polygon(corners, 10));
  EXPECT_EQ(remove_short(curves, 0.1, 10, 0.001), 1);
  EXPECT_NEAR(geometry(curves).enclosed(), 1.01, 1e-15);
}

TEST(CurveAdaptivity, RefusesOptionsThatMakeNoSense) {
  CurveMesh curves(circle({0, 0}, 1, 0.1));
  EXPECT_THROW(adapt(curves, {}), UsageError);
}

}  // namespace
}  // namespace surf::curve
