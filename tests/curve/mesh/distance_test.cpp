#include "libcurve/mesh/distance.h"

#include <random>

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

TEST(CurveDistance, IsThatToTheNearestElement) {
  const Segments curves = grid_of_circles({0, 0}, {3, 3}, 1, 0.4, 0.05);
  const DistanceToCurves distance(curves);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 4);
  for (int k = 0; k < 300; ++k) {
    const Vector<2> p(uniform(random), uniform(random));
    EXPECT_NEAR(distance(p), winding_round(curves, p).distance, 1e-14);
  }
}

TEST(CurveDistance, BetweenConcentricCirclesIsTheDifferenceOfTheirRadii) {
  const CurveDistances d = curve_distances(circle({0, 0}, 1, 0.01), circle({0, 0}, 1.1, 0.01));
  constexpr double kTolerance = 2e-5;  // polygons lie within h^2 / 8 of their circles
  for (const double value : {d.mean_mm, d.rms_mm, d.p95_mm, d.max_mm})
    EXPECT_NEAR(value, 0.1, kTolerance);
}

TEST(CurveDistance, OfAKnownShapeHasASign) {
  const auto to_circle = [](const Vector<2>& p) { return p.norm() - 1; };
  const DistanceStatistics d = distances_from(circle({0, 0}, 0.9, 0.01), to_circle);
  EXPECT_NEAR(d.signed_mean_mm, -0.1, 2e-5);
  EXPECT_NEAR(d.mean_mm, 0.1, 2e-5);
}

TEST(CurveDistance, RefusesWhatHasNoLength) {
  EXPECT_THROW(DistanceToCurves{Segments{}}, InvalidMesh);
  Segments point{Points<2>::Zero(2, 2), Elements<2>(1, 2)};
  point.elements << 0, 1;
  EXPECT_THROW(curve_distances(point, point), InvalidMesh);
}

}  // namespace
}  // namespace surf::curve
