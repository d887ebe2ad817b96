#include "libcurve/mesh/surgery.h"

#include <map>
#include <random>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

struct Result {
  Segments curves;
  SurgeryReport report;
  std::map<std::string, int> kinds;
  CurveHierarchy hierarchy;
  int n_components() const { return static_cast<int>(hierarchy.components.size()); }
};

Result after_surgery(const Segments& curves, const SurgeryOptions& options = {}) {
  Result out;
  CurveMesh mesh(curves);
  out.report = operate(mesh, options);
  out.curves = mesh.segments();
  EXPECT_TRUE(out.report.is_resolved);
  if (mesh.size() > 0) expect_valid(out.curves);
  for (const auto& event : out.report.events) ++out.kinds[to_string(event.kind)];
  if (mesh.size() > 0) out.hierarchy = curve_hierarchy(out.curves);
  return out;
}

/// Random points are in the new domain where the old curves wind round them at least once.
void expect_same_domain(const Segments& before, const Segments& after, unsigned seed,
                        const std::string& what) {
  const Vector<2> lower = before.points.colwise().minCoeff(),
                  upper = before.points.colwise().maxCoeff();
  const double tolerance = 1e-9 * (upper - lower).norm();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-0.05, 1.05);
  for (int k = 0; k < 60; ++k) {
    const Vector<2> p =
        lower + Vector<2>(uniform(random), uniform(random)).cwiseProduct(upper - lower);
    const Winding old = winding_round(before, p), now = winding_round(after, p);
    if (std::min(old.distance, now.distance) < tolerance) continue;
    EXPECT_EQ(now.number, old.number >= 1 ? 1 : 0) << what << " at " << p.transpose();
  }
}

Points<2> random_corners(std::mt19937& random, int n, int n_grid) {
  std::uniform_int_distribution<int> coordinate(0, n_grid - 1);
  Points<2> corners(n, 2);
  for (double& value : corners.reshaped()) value = coordinate(random);
  return corners;
}

TEST(Surgery, OfAnyPolygonsIsTheBoundaryOfWhereTheyWindAtLeastOnce) {
  // Small grids: overlaps, spikes, repeated nodes, many crossings in one point.
  for (unsigned seed = 0; seed < 600; ++seed) {
    std::mt19937 random(seed);
    const int n_grid = 3 + int(seed) % 9 * (seed % 2 ? 1 : 1000);
    std::vector<Segments> parts;
    for (unsigned part = 0; part < 1 + seed % 4; ++part)
      parts.push_back(polygon(random_corners(random, 3 + int(seed) % 17, n_grid), 1e9));
    const Segments curves = joined(parts);
    CurveMesh mesh(curves);
    SurgeryOptions options;
    const SurgeryReport report = operate(mesh, options);
    const std::string what = "seed " + std::to_string(seed);
    ASSERT_TRUE(report.is_resolved) << what;
    if (mesh.size() > 0) expect_valid(mesh.segments(), what);
    expect_same_domain(curves, mesh.segments(), seed, what);
  }
}

TEST(Surgery, ReportsEveryEventOfTheThesisAndOnlyIt) {
  const double h = 0.05;
  {
    const Result r = after_surgery(joined({circle({0, 0}, 1, h), circle({1.9, 0.02}, 1, h)}));
    EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"merging", 1}}));
    EXPECT_EQ(r.n_components(), 1);
    EXPECT_NEAR(r.report.events[0].place[0], 0.95, 0.01);
  }
  {
    const Result r =
        after_surgery(joined({circle({0, 0}, 1, h), flipped(circle({0.52, 0.01}, 0.5, h))}));
    EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"inside-opening", 1}}));
    EXPECT_EQ(r.n_components(), 1);
  }
  {
    // A dumbbell whose neck was turned inside out.
    Points<2> corners(12, 2);
    corners << -3, -1, -1, -1, -0.5, 0.1, 0.5, 0.1, 1, -1, 3, -1, 3, 1, 1, 1, 0.5, -0.1, -0.5, -0.1,
        -1, 1, -3, 1;
    const Result r = after_surgery(polygon(corners, h));
    EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"splitting", 1}}));
    EXPECT_EQ(r.n_components(), 2);
  }
  {
    // A C whose ends overlap.
    Points<2> corners(10, 2);
    corners << 0, 0, 4, 0, 4, 2.05, 3, 2.05, 3, 1, 1, 1, 1, 3, 3, 3, 3, 1.95, 4.05, 1.95;
    Points<2> closed(13, 2);
    closed << corners, 4.05, 4, 0, 4, 0, 2;
    const Result r = after_surgery(polygon(closed, h));
    EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"self-merging", 1}}));
    EXPECT_EQ(r.n_components(), 2);
  }
  {
    // A square with a loop of the wrong sense at one side.
    Points<2> corners(9, 2);
    corners << 0, 0, 2, 0, 2, 1.4, 2.4, 1.4, 2.4, 1, 1.9, 1, 1.9, 2, 1, 2, 0, 2;
    const Result r = after_surgery(polygon(corners, 10));
    EXPECT_EQ(r.n_components(), 1);
    EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"self-crossing", 1}}));
    EXPECT_NEAR(r.report.events[0].enclosed_change, 0.16, 1e-12);  // of the loop, counted as -1
  }
}

TEST(Surgery, OfSeveralEventsAtOnceReportsEach) {
  // A chain of five discs, a hole of the first that meets its boundary, a disc far away.
  std::vector<Segments> parts;
  for (int k = 0; k < 5; ++k) parts.push_back(circle({1.9 * k, 0.01 * k}, 1, 0.05));
  parts.push_back(flipped(circle({-0.65, 0.3}, 0.4, 0.05)));
  parts.push_back(circle({0, 5}, 1, 0.05));
  const Result r = after_surgery(joined(parts));
  EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"merging", 4}, {"inside-opening", 1}}));
  EXPECT_EQ(r.n_components(), 2);
}

TEST(Surgery, OfAGridOfOverlappingDiscsOpensTheHolesBetweenThem) {
  const Result r = after_surgery(grid_of_circles({0, 0}, {5, 5}, 1, 0.55, 0.03));
  EXPECT_EQ(r.n_components(), 1 + 16);
  // 24 mergings join 25 discs; the other 16 of 40 contacts close a hole each.
  EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"merging", 24}, {"self-merging", 16}}));
}

TEST(Surgery, KeepsUntouchedNodesBitForBit) {
  const Segments curves = joined({circle({0, 0}, 1, 0.05), circle({1.9, 0.1}, 1, 0.05)});
  const Result r = after_surgery(curves);
  Eigen::Index old = 0, n_same = 0;
  for (Eigen::Index i = 0; i < r.curves.points.rows(); ++i) {
    Eigen::Index at = old;
    while (at < curves.points.rows() && curves.points.row(at) != r.curves.points.row(i)) ++at;
    if (at == curves.points.rows()) continue;
    old = at + 1;  // in their order
    ++n_same;
  }
  EXPECT_EQ(n_same, r.curves.points.rows() - 2);  // all but the two crossings
}

TEST(Surgery, ChangesTheAreaByWhatWasCoveredTwice) {
  // Two unit discs at distance d: the lens has 2 acos(d/2) - d/2 sqrt(4 - d^2).
  const double d = 1.5;
  const Segments curves = joined({circle({0, 0}, 1, 0.002), circle({d, 0}, 1, 0.002)});
  const Result r = after_surgery(curves);
  const double lens = 2 * std::acos(d / 2) - d / 2 * std::sqrt(4 - d * d);
  // Polygons of elements h lie within h^2 / 8 of the circles.
  EXPECT_NEAR(r.report.events.at(0).enclosed_change, -lens, 1e-5);
  EXPECT_NEAR(r.hierarchy.components[0].area_mm2, 2 * M_PI - lens, 1e-5);
}

TEST(Surgery, RemovesPhantomsWithoutACrossing) {
  // Inverted in the open; a disc in a disc; a hole in a hole.
  EXPECT_EQ(after_surgery(joined({circle({5, 0}, 1, 0.1), flipped(circle({0, 0}, 1, 0.1))}))
                .n_components(),
            1);
  EXPECT_EQ(
      after_surgery(joined({circle({0, 0}, 1, 0.1), circle({0, 0}, 0.5, 0.1)})).n_components(), 1);
  const Result r = after_surgery(joined(
      {circle({0, 0}, 3, 0.1), flipped(circle({0, 0}, 2, 0.1)), flipped(circle({0, 0}, 1, 0.1))}));
  EXPECT_EQ(r.n_components(), 2);
  EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"vanishing", 1}}));
}

TEST(Surgery, LeavesNothingOfAnInvertedCurve) {
  EXPECT_EQ(after_surgery(flipped(circle({0, 0}, 1, 0.1))).curves.elements.rows(), 0);
}

TEST(Surgery, RemovesCrumbsWithWhatLiesInThem) {
  SurgeryOptions options;
  options.min_area_mm2 = 1;
  const Result r = after_surgery(
      joined({circle({0, 0}, 3, 0.1), circle({10, 0}, 0.5, 0.1), flipped(circle({10, 0}, 0.3, 0.1)),
              flipped(circle({1, 0}, 0.4, 0.1)), circle({1, 0}, 0.2, 0.1)}),
      options);
  EXPECT_EQ(r.n_components(), 1);
  EXPECT_EQ(r.kinds, (std::map<std::string, int>{{"vanishing", 4}}));
}

// Thesis 4.3.2.3: three curves, one in the other, that touch in one point at one time.
TEST(Surgery, OfNestedCurvesThatTouchInOnePointIsValid) {
  Points<2> square(4, 2);
  square << 0, 0, 1, -1, 2, 0, 1, 1;
  const auto scaled = [&](double by) { return polygon(by * square, 10); };
  const Segments curves = joined({scaled(3), flipped(scaled(2)), scaled(1)});
  const Result r = after_surgery(curves);
  expect_same_domain(curves, r.curves, 1, "nested");
}

TEST(Surgery, OfManyElementsThatCrossOneElementIsValid) {
  // A comb of 40 teeth pushed through a thin bar (Fig. 4.7: multiple intersections).
  Points<2> comb(2 + 4 * 40, 2);
  for (int k = 0; k < 40; ++k)
    comb.middleRows(4 * k, 4) << k, 0, k + 0.3, -3, k + 0.6, 0, k + 0.8, 0;
  comb.bottomRows(2) << 40, 1, 0, 1;
  Points<2> bar(4, 2);
  bar << -1, -2, 41, -2, 41, -1, -1, -1;
  const Segments curves = joined({polygon(comb, 100), polygon(bar, 100)});
  const Result r = after_surgery(curves);
  EXPECT_EQ(r.n_components(), 1 + 39);
  expect_same_domain(curves, r.curves, 2, "comb");
}

TEST(Surgery, OfEqualCurvesIsOneOfThem) {
  const Segments one = circle({0, 0}, 1, 0.1);
  EXPECT_EQ(after_surgery(joined({one, one})).curves.elements.rows(), one.elements.rows());
  EXPECT_EQ(after_surgery(joined({one, flipped(one)})).curves.elements.rows(), 0);
}

TEST(Surgery, JoinsSheetsThatComeCloserThanTheResolution) {
  SurgeryOptions options;
  options.resolution_mm = 0.1;
  const Segments now = joined({circle({0, 0}, 1, 0.1), circle({2.05, 0}, 1, 0.1)});
  const Segments then = joined({circle({0, 0}, 1, 0.1), circle({2.15, 0}, 1, 0.1)});
  CurveMesh mesh(now);
  const SurgeryReport report = operate(mesh, options, then.points);
  ASSERT_TRUE(report.is_resolved);
  expect_valid(mesh.segments());
  EXPECT_EQ(curve_hierarchy(mesh.segments()).components.size(), 1u);
  EXPECT_EQ(report.events.at(0).kind, flow::TopologyChange::kMerging);
  CurveMesh parting(then);
  EXPECT_FALSE(operate(parting, options, now.points).has_changed);
}

TEST(Surgery, CutsWallsThinnerThanTheResolution) {
  SurgeryOptions options;
  options.resolution_mm = 0.1;
  const auto ring = [](double x) {
    return joined({circle({0, 0}, 2, 0.1), flipped(circle({x, 0}, 1, 0.1))});
  };
  CurveMesh mesh(ring(0.95));
  const SurgeryReport report = operate(mesh, options, ring(0.85).points);
  expect_valid(mesh.segments());
  EXPECT_EQ(report.events.at(0).kind, flow::TopologyChange::kInsideOpening);
  EXPECT_EQ(curve_hierarchy(mesh.segments()).components.size(), 1u);
}

TEST(Surgery, BringsElementsAtEventsDownToTheResolution) {
  SurgeryOptions options;
  options.resolution_mm = 0.1;
  Points<2> bar(4, 2);
  bar << 0, 0, 10, 0, 10, 1, 0, 1;
  CurveMesh mesh(joined({polygon(bar, 100), circle({5, 1.5}, 1, 0.1)}));
  operate(mesh, options);
  expect_valid(mesh.segments());
  // Next to a crossing no element is longer than twice the resolution.
  int n_crossings = 0;
  for (int i = 0; i < mesh.size(); ++i) {
    if (mesh.point(i)[1] != 1 || std::abs(std::abs(mesh.point(i)[0] - 5) - 0.866) > 0.01) continue;
    ++n_crossings;
    EXPECT_LE(std::max(mesh.length(i), mesh.length(mesh.prev(i))), 0.2);
  }
  EXPECT_EQ(n_crossings, 2);
}

TEST(Surgery, RefusesOptionsThatMakeNoSense) {
  CurveMesh mesh(circle({0, 0}, 1, 0.1));
  EXPECT_THROW(operate(mesh, {.resolution_mm = -1}), UsageError);
}

}  // namespace
}  // namespace surf::curve
