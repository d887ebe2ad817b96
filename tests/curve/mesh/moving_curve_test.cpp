#include "libcurve/mesh/moving_curve.h"

#include <map>
#include <random>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/flow/evolution.h"
#include "tests/curve/curves.h"

namespace surf::curve {
namespace {

constexpr double kEdge = 0.1;

MovingCurveOptions options_with(double edge_length) {
  MovingCurveOptions options;
  options.edge_length_mm = edge_length;
  return options;
}

/// Every node by `distance` along its normal.
Points<2> grown(const MovingCurve& curve, double distance) {
  const fem::Geometry<2> shape = curve.geometry();
  return shape.points() + distance * shape.nodal_normals().rowwise().normalized();
}

/// Steps along the normals; the events by kind.
std::map<std::string, int> grow(MovingCurve& curve, double step, int n_steps) {
  std::map<std::string, int> kinds;
  for (int k = 0; k < n_steps; ++k) {
    Points<2> to = grown(curve, step);
    curve.restrict_move(to);
    curve.move_to(to);
    curve.mend();
    expect_valid(curve.simplices(), "step " + std::to_string(k));
    for (const auto& event : curve.take_events()) ++kinds[to_string(event.kind)];
  }
  return kinds;
}

int n_components(const MovingCurve& curve) {
  return static_cast<int>(curve_hierarchy(curve.simplices()).components.size());
}

/// A square of side 4 with nodes a `kEdge` apart, but for a much shorter and a much longer element
/// in its left and in its right side.
Segments uneven_square() {
  std::vector<Vector<2>> nodes;
  const auto side = [&](const Vector<2>& from, const Vector<2>& to) {
    for (int i = 0; i < 40; ++i) nodes.push_back(from + (to - from) * i / 40.0);
  };
  side({0, 0}, {4, 0});
  side({4, 0}, {4, 4});
  side({4, 4}, {0, 4});
  side({0, 4}, {0, 0});
  nodes[60][1] -= 0.8 * kEdge;   // of the right side: elements of 0.02 and 0.18
  nodes[140][1] += 0.8 * kEdge;  // of the left one
  nodes[70][1] += 0.6 * kEdge;
  nodes[150][1] -= 0.6 * kEdge;
  Segments out{points_of<2>(nodes), Elements<2>(160, 2)};
  for (int i = 0; i < 160; ++i) out.elements.row(i) << i, (i + 1) % 160;
  return out;
}

TEST(MovingCurve, MendsNothingOutsideOfItsRegion) {
  const Segments start = uneven_square();
  MovingCurveOptions options = options_with(kEdge);
  const auto region = std::make_shared<mesh::Neighbourhood<2>>(kEdge);
  for (const auto& point : start.points.rowwise())
    if (point[0] > 3) region->add(point.transpose());
  options.region = region;
  MovingCurve curve(start, options);
  const auto has = [&](double x, double y) {
    const Points<2> now = curve.simplices().points;
    return (now.rowwise() - Eigen::RowVector2d(x, y)).rowwise().squaredNorm().minCoeff() == 0;
  };
  for (int step = 0; step < 3; ++step) {
    int n_resting = 0;
    for (const auto& point : start.points.rowwise())
      if (point[0] < 2.5) {
        EXPECT_TRUE(has(point[0], point[1])) << point << " in step " << step;
        ++n_resting;
      }
    EXPECT_GT(n_resting, 80);
    // The short element is from 59 to 60.
    const bool is_mended = !has(4, start.points(59, 1)) || !has(4, start.points(60, 1));
    EXPECT_TRUE(is_mended) << "in the region short elements go";
    curve.move_to(curve.geometry().points());
    curve.mend();
  }
}

TEST(MovingCurve, MergesDiscsThatGrowIntoEachOtherAndClosesTheHoleBetweenFour) {
  MovingCurve curve(grid_of_circles({0, 0}, {2, 2}, 1, 0.4, kEdge), options_with(kEdge));
  const auto kinds = grow(curve, 0.02, 6);
  EXPECT_EQ(kinds.at("merging"), 3);
  EXPECT_EQ(kinds.at("self-merging"), 1);
  EXPECT_EQ(n_components(curve), 2);
  // The hole shrinks and goes.
  EXPECT_EQ(grow(curve, 0.02, 12).at("vanishing"), 1);
  EXPECT_EQ(n_components(curve), 1);
}

TEST(MovingCurve, SplitsAtANeckThatShrinks) {
  Points<2> corners(12, 2);
  corners << -3, -1, -1, -1, -1, -0.2, 1, -0.2, 1, -1, 3, -1, 3, 1, 1, 1, 1, 0.2, -1, 0.2, -1, 1,
      -3, 1;
  MovingCurve curve(polygon(corners, kEdge), options_with(kEdge));
  EXPECT_GE(grow(curve, -0.03, 8).at("splitting"), 1);
  EXPECT_EQ(n_components(curve), 2);
}

TEST(MovingCurve, WithFixedTopologyNeverTouchesItself) {
  MovingCurveOptions options = options_with(kEdge);
  options.topology = Topology::kFixed;
  MovingCurve curve(grid_of_circles({0, 0}, {2, 2}, 1, 0.4, kEdge), options);
  EXPECT_TRUE(grow(curve, 0.03, 20).empty());
  EXPECT_EQ(n_components(curve), 4);
}

// They could never move apart, and what came of them was refused at the end.
TEST(MovingCurve, WithFixedTopologyRefusesAStartThatMeetsItself) {
  MovingCurveOptions options = options_with(kEdge);
  const Segments both = joined({circle({0, 0}, 1, kEdge), circle({1.5, 0}, 1, kEdge)});
  EXPECT_EQ(n_components(MovingCurve(both, options)), 1);
  options.topology = Topology::kFixed;
  EXPECT_THROW(MovingCurve(both, options), InvalidMesh);
}

TEST(MovingCurve, ReportsWhatItHoldsBack) {
  MovingCurveOptions options = options_with(kEdge);
  options.topology = Topology::kFixed;
  MovingCurve curve(joined({circle({0, 0}, 1, kEdge), circle({2.06, 0}, 1, kEdge)}), options);
  Points<2> to = grown(curve, 0.05);
  const double held = curve.restrict_move(to);
  EXPECT_GT(held, 0);
  EXPECT_LT(held, 0.2);
}

TEST(MovingCurve, StaysInTheBoxAndEndsWhereMostOfItMeetsTheBorder) {
  MovingCurveOptions options = options_with(kEdge);
  Eigen::Affine2d index_to_world = Eigen::Translation2d(-1, -1) * Eigen::Scaling(0.1);
  options.box = ImageBox<2>{{21, 21}, index_to_world, index_to_world.inverse()};
  MovingCurve curve(circle({0, 0}, 0.8, kEdge), options);
  EXPECT_EQ(curve.obstacle(), "");
  grow(curve, 0.05, 20);
  EXPECT_LE(curve.simplices().points.cwiseAbs().maxCoeff(), 1.05 + 1e-12);
  EXPECT_GT(curve.border_share(), 0.9);
  EXPECT_NE(curve.obstacle().find("border"), std::string::npos);
}

TEST(MovingCurve, EndsWhereTheObjectVanishes) {
  MovingCurve curve(circle({0, 0}, 0.3, kEdge), options_with(kEdge));
  grow(curve, -0.08, 5);
  EXPECT_NE(curve.obstacle().find("vanished"), std::string::npos);
}

TEST(MovingCurve, DoesNotComeOutOnTheOtherSideOfAPoint) {
  MovingCurve curve(joined({circle({0, 0}, 0.5, kEdge), circle({5, 0}, 2, kEdge)}),
                    options_with(kEdge));
  EXPECT_EQ(grow(curve, -0.8, 1).at("vanishing"), 1);
  EXPECT_EQ(n_components(curve), 1);
}

/// 1 but for a valley of the given depth on the circle of radius 0.7 round the origin.
class RoundValley : public Field<2> {
 public:
  explicit RoundValley(double depth) : depth_(depth) {}
  void sample(const Points<2>& x, Derivatives, Samples<2>& out) const override {
    const Eigen::ArrayXd off = (x.rowwise().norm().array() - 0.7) / 0.05;
    out.value = 1 - depth_ * (-off.square()).exp();
  }

 private:
  double depth_;
};

/// Smallest and largest radius after a step that is to shrink the unit circle by 0.5.
std::array<double, 2> radii_after_a_long_step(std::shared_ptr<const Field<2>> edge_indicator) {
  MovingCurveOptions options = options_with(kEdge);
  options.edge_indicator = std::move(edge_indicator);
  options.path_spacing_mm = 0.025;
  MovingCurve curve(circle({0, 0}, 1, kEdge), options);
  Points<2> to = 0.5 * curve.geometry().points();
  curve.restrict_move(to);
  const Eigen::VectorXd r = to.rowwise().norm();
  return {r.minCoeff(), r.maxCoeff()};
}

TEST(MovingCurve, StopsAtTheFirstEdgeOnItsWay) {
  const auto [least, largest] = radii_after_a_long_step(std::make_shared<RoundValley>(0.9));
  EXPECT_GE(least, 0.7 - 0.025);
  EXPECT_LE(largest, 0.7 + 0.025);
}

TEST(MovingCurve, PassesRipplesAndWithoutAnIndicatorEdges) {
  for (const auto& field : {std::shared_ptr<RoundValley>(), std::make_shared<RoundValley>(0.2)})
    EXPECT_NEAR(radii_after_a_long_step(field)[1], 0.5, 1e-12);
}

TEST(MovingCurve, KeepsElementsNearTheWantedLength) {
  MovingCurve curve(circle({0, 0}, 0.3, 0.03), options_with(kEdge));
  grow(curve, 0.05, 40);
  const Eigen::VectorXd lengths = curve.geometry().measures();
  EXPECT_LE(lengths.maxCoeff(), 4.0 / 3 * kEdge * (1 + 1e-9));
  EXPECT_GE(lengths.minCoeff(), 0.4 * kEdge);
}

TEST(MovingCurve, IsCoarseWhereItIsStraight) {
  MovingCurveOptions options = options_with(0.02);
  options.coarseness = 16;
  options.adaptivity.geometry_tolerance_mm = 0.02;
  Eigen::Matrix2d axes = Eigen::Vector2d(4, 0.3).asDiagonal();
  const MovingCurve curve(ellipse({0, 0}, axes, 0.02), options);
  const fem::Geometry<2> shape = curve.geometry();
  EXPECT_LT(shape.n_elements(), 150);
  EXPECT_GT(shape.measures().maxCoeff(), 4 * shape.measures().minCoeff());
  EXPECT_LE(fem::geometric_variation(shape).maxCoeff(), 0.02 * 1.001);
}

TEST(MovingCurve, ResolvesInitialCurvesThatOverlap) {
  const MovingCurve curve(joined({circle({0, 0}, 1, kEdge), circle({1, 0}, 1, kEdge)}),
                          options_with(kEdge));
  expect_valid(curve.simplices());
  EXPECT_EQ(n_components(curve), 1);
}

TEST(MovingCurve, RefusesOpenCurvesNothingAndWrongOptions) {
  Segments open = circle({0, 0}, 1, kEdge);
  open.elements.conservativeResize(open.elements.rows() - 1, 2);
  EXPECT_THROW(MovingCurve(open, options_with(kEdge)), InvalidMesh);
  EXPECT_THROW(MovingCurve(flipped(circle({0, 0}, 1, kEdge)), options_with(kEdge)), InvalidMesh);
  EXPECT_THROW(MovingCurve(circle({0, 0}, 1, kEdge), options_with(0)), UsageError);
  MovingCurveOptions genus = options_with(kEdge);
  genus.topology = Topology::kGenus0;
  EXPECT_THROW(MovingCurve(circle({0, 0}, 1, kEdge), genus), UsageError);
}

/// (|x - a|^2 - 1)(|x + a|^2 - 1) is negative in two unit discs about a and -a.
class TwoDiscs : public Field<2> {
 public:
  void sample(const Points<2>& x, Derivatives order, Samples<2>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<2> u = x.row(i).transpose() - a_, v = x.row(i).transpose() + a_;
      const double p = u.squaredNorm() - 1, q = v.squaredNorm() - 1;
      out.value[i] = p * q;
      if (order >= Derivatives::kFirst) out.gradient.row(i) = 2 * (q * u + p * v);
      if (order < Derivatives::kSecond) continue;
      const Eigen::Matrix2d h =
          2 * (p + q) * Eigen::Matrix2d::Identity() + 4 * (u * v.transpose() + v * u.transpose());
      out.hessian.row(i) << h(0, 0), h(0, 1), h(1, 0), h(1, 1);
    }
  }

 private:
  Vector<2> a_{1.3, 0};
};

TEST(MovingCurve, InAFlowFindsTwoObjectsFromOneCurveRoundBoth) {
  MovingCurveOptions options = options_with(0.08);
  options.max_displacement_mm = 0.1;
  MovingCurve curve(circle({0, 0}, 2.6, 0.08), options);
  energy::DomainIntegral<2> energy(std::make_shared<const TwoDiscs>(), {.ray_spacing_mm = 0.05});
  flow::FlowOptions flow;
  flow.velocity.product = flow::ScalarProduct::kL2;
  flow.max_steps = 300;
  // F is large far away, so what happens at the neck is a small share of the whole decrease.
  flow.energy_tol = 1e-6;
  flow.rel_tol = 1e-8;
  std::map<std::string, int> kinds;
  const auto summary = flow::evolve<2>(curve, energy, flow, [&](const flow::StepRecord& record) {
    for (const auto& event : record.events) ++kinds[to_string(event.kind)];
    expect_valid(curve.simplices());
    return true;
  });
  EXPECT_EQ(summary.termination, flow::Termination::kConverged) << summary.message;
  EXPECT_EQ(kinds["splitting"], 1);
  EXPECT_EQ(n_components(curve), 2);
  EXPECT_NEAR(curve.geometry().enclosed(), 2 * M_PI, 0.01 * 2 * M_PI);
}

/// Points on both sides of curves in a random flow stay on their side, with mending and surgery.
TEST(MovingCurve, StaysAwayFromHeldPointsInRandomFlows) {
  constexpr double kRadius = 0.03;
  int n_near = 0, n_events = 0;
  for (const Topology topology : {Topology::kFree, Topology::kFixed}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> uniform(-1, 1);
      MovingCurveOptions options = options_with(kEdge);
      options.topology = topology;
      options.coarseness = 4;
      options.adaptivity.geometry_tolerance_mm = 0.05;
      options.held_distance_mm = kRadius;
      const Segments discs = grid_of_circles({0, 0}, {2, 2}, 1, 0.4, kEdge);
      for (int n = 0; n < 60; ++n) {
        const Vector<2> point(0.5 + uniform(random), 0.5 + uniform(random));
        const Winding at = winding_round(discs, point);
        if (at.distance > 2 * kRadius) options.held_points.push_back({point, at.number > 0});
      }
      Eigen::Matrix2d waves;
      for (double& x : waves.reshaped()) x = 4 * uniform(random);
      MovingCurve curve(discs, options);
      for (int k = 0; k < 15; ++k) {
        Points<2> to = grown(curve, seed % 2 ? 0.03 : -0.02);
        for (auto row : to.rowwise())
          row += 0.05 * (waves * row.transpose()).array().sin().matrix().transpose();
        curve.restrict_move(to);
        curve.move_to(to);
        curve.mend();
        const Segments now = curve.simplices();
        expect_valid(now);
        for (const auto& held : options.held_points) {
          const Winding at = winding_round(now, held.point);
          ASSERT_EQ(at.number > 0, held.is_inside)
              << int(topology) << ", seed " << seed << ", step " << k;
          ASSERT_GE(at.distance, (1 - 1e-6) * kRadius) << seed << ", step " << k;
          n_near += at.distance < 1.5 * kRadius;
        }
        n_events += int(curve.take_events().size());
      }
    }
  }
  EXPECT_GT(n_near, 500);  // else nothing was tried
  EXPECT_GT(n_events, 10);
}

TEST(MovingCurve, BringsItsStartToWhereItHasPointsNearItsEdge) {
  MovingCurveOptions options = options_with(0.2);
  options.coarseness = 4;
  options.adaptivity.geometry_tolerance_mm = 0.1;
  options.held_distance_mm = 0.07;
  options.held_points = {{{0.8, 0}, false},  // 0.2 deep
                         {{0, 1.2}, true},
                         {{0, -1.03}, false},  // outside, but too near
                         {{0, 0.2}, false}};   // too deep
  const MovingCurve curve(circle({0, 0}, 1, 0.2), options);
  expect_valid(curve.simplices());
  EXPECT_EQ(mesh::are_held<2>(curve.simplices(), options.held_points, 0.07, {}),
            (std::vector<char>{1, 1, 1, 0}));
}

TEST(MovingCurve, StartsInsideItsBox) {
  MovingCurveOptions options;
  options.box = ImageBox<2>{{21, 21}, Eigen::Affine2d::Identity(), Eigen::Affine2d::Identity()};
  const MovingCurve curve(circle({18, 10}, 6, 0.5), options);
  const Segments now = curve.simplices();
  EXPECT_LE(now.points.maxCoeff(), 20.5);
  expect_valid(now);
  // The disc without the cap beyond x = 20.5, d = 2.5 from its centre.
  const double cap = 36 * std::acos(2.5 / 6) - 2.5 * std::sqrt(36 - 2.5 * 2.5);
  EXPECT_NEAR(curve.geometry().enclosed(), M_PI * 36 - cap, 1);
}

}  // namespace
}  // namespace surf::curve
