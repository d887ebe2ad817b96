#include "libsurf/mesh/moving_surface.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <set>
#include <stop_token>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// The cube of index space [0, 20]^3 at 0.5 mm, about the origin, turned.
ImageBox<3> some_box() {
  const Eigen::Affine3d affine = Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 3).normalized()) *
                                 Eigen::Scaling(0.5) * Eigen::Translation3d(-10, -10, -10);
  return {{21, 21, 21}, affine, affine.inverse()};
}

/// One step along `velocity`, as a flow makes it.
double step(MovingSurface& surface, const Points<3>& displacement) {
  Points<3> to = surface.geometry().points() + displacement;
  const double held_share = surface.restrict_move(to);
  surface.move_to(to);
  surface.mend();
  return held_share;
}

Points<3> normals(const MovingSurface& surface) {
  return surface.geometry().nodal_normals().rowwise().normalized();
}

/// Sum of plane waves with lengths from about 1 to 6.
Points<3> random_field(const Points<3>& X, unsigned seed, double amplitude) {
  std::mt19937 random(seed);
  Points<3> out = Points<3>::Zero(X.rows(), 3);
  for (int wave = 0; wave < 4; ++wave) {
    const WavyField field(random, amplitude / 2);
    for (Eigen::Index i = 0; i < X.rows(); ++i) out.row(i) += field(X.row(i).transpose());
  }
  return out;
}

/// As flows do: what lies on faces of the box moves along them. It is this that keeps it there, not
/// the surface: by a displacement of 1e-3 mm across a face it would leave the border.
Points<3> along_faces(const ImageBox<3>& box, const Points<3>& X, Points<3> displacement) {
  const Points<3> normals = box.normals();
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const std::uint8_t faces = box.faces(X.row(i).transpose());
    for (int face = 0; face < 6; ++face)
      if (faces >> face & 1)
        displacement.row(i) -= displacement.row(i).dot(normals.row(face)) * normals.row(face);
  }
  return displacement;
}

void expect_sound(const MovingSurface& surface) {
  const Verification check = verify(surface.simplices());
  EXPECT_TRUE(check.passed()) << check.message();
}

TEST(MovingSurface, GrowsFromASeedAndStaysClosedWithEdgesOfTheWantedLength) {
  MovingSurface surface(ball({0, 0, 0}, 1, 0.5), {.edge_length_mm = 0.5, .box = {}});
  for (int k = 0; k < 30; ++k) {
    step(surface, 0.2 * normals(surface));
    ASSERT_TRUE(verify(surface.simplices()).passed()) << "step " << k;
  }
  EXPECT_NEAR(surface.geometry().radius(), 7, 0.1);
  const Quality shape = quality(surface.simplices());
  EXPECT_LE(shape.max_edge_mm, 0.5 * 4 / 3 * 1.001);
  EXPECT_NEAR(shape.mean_edge_mm, 0.5, 0.15);
  EXPECT_GT(shape.min_angle_deg, 15);
}

/// 1 but for a valley of the given depth on the sphere of radius 1.4 round the origin.
class RoundValley : public Field<3> {
 public:
  explicit RoundValley(double depth) : depth_(depth) {}
  void sample(const Points<3>& x, Derivatives, Samples<3>& out) const override {
    const Eigen::ArrayXd off = (x.rowwise().norm().array() - 1.4) / 0.1;
    out.value = 1 - depth_ * (-off.square()).exp();
  }

 private:
  double depth_;
};

TEST(MovingSurface, StopsAtTheFirstEdgeOnItsWayAndPassesRipples) {
  for (const double depth : {0.9, 0.2}) {
    MovingSurfaceOptions options;
    options.edge_length_mm = 0.3;
    options.edge_indicator = std::make_shared<RoundValley>(depth);
    options.path_spacing_mm = 0.05;
    MovingSurface surface(ball(Vector<3>::Zero(), 1, 0.3), options);
    Points<3> to = 2 * surface.geometry().points();
    surface.restrict_move(to);
    const Eigen::VectorXd r = to.rowwise().norm();
    const double expected = depth > 0.5 ? 1.4 : 2;
    EXPECT_NEAR(r.minCoeff(), expected, 0.05) << depth;
    EXPECT_NEAR(r.maxCoeff(), expected, 0.05) << depth;
  }
}

TEST(MovingSurface, CoarsensAsItShrinks) {
  MovingSurface surface(ball({0, 0, 0}, 5, 0.5), {.edge_length_mm = 0.5, .box = {}});
  const auto n_before = surface.geometry().n_elements();
  while (surface.geometry().radius() > 1.5) step(surface, -0.2 * normals(surface));
  expect_sound(surface);
  EXPECT_LT(surface.geometry().n_elements(), n_before / 4);
}

TEST(MovingSurface, BeginsAsCoarseAsGeometryAllows) {
  MovingSurfaceOptions options{.edge_length_mm = 0.1, .coarseness = 4, .box = {}};
  options.adaptivity.geometry_tolerance_mm = 0.3;
  const Triangles fine = ball({0, 0, 0}, 2, 0.1);
  const MovingSurface surface(fine, options);
  EXPECT_LT(surface.geometry().n_elements(), fine.elements.rows() / 4);
  EXPECT_NEAR(surface.geometry().radius(), 2, 0.02);
  EXPECT_TRUE(verify(surface.simplices()).passed());
}

TEST(MovingSurface, IsClampedAtTheBorderOfTheVolume) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}};
  options.box = some_box();
  MovingSurface surface(ball({0, 0, 0}, 3, 0.6), options);
  EXPECT_EQ(surface.border_share(), 0);
  constexpr double kRounding = 1e-12;  // of the way to world and back
  for (int k = 0; k < 14; ++k) {
    Points<3> to = surface.geometry().points() + 0.25 * normals(surface);
    surface.restrict_move(to);
    for (Eigen::Index i = 0; i < to.rows(); ++i) {
      const Eigen::Array3d index = (options.box->world_to_index * Vector<3>(to.row(i))).array();
      EXPECT_GE(index.minCoeff(), -0.5 - kRounding);
      EXPECT_LE(index.maxCoeff(), 20.5 + kRounding);
    }
    surface.move_to(to);
    surface.mend();
  }
  EXPECT_GT(surface.border_share(), 0.05);
}

TEST(MovingSurface, ReportsThatItFillsTheVolume) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}, .max_border_share = 0.3};
  options.box = some_box();
  MovingSurface surface(ball({0, 0, 0}, 4, 0.6), options);
  EXPECT_EQ(surface.obstacle(), "");
  for (int k = 0; k < 40 && surface.obstacle().empty(); ++k) step(surface, 0.25 * normals(surface));
  EXPECT_NE(surface.obstacle().find("fills the volume"), std::string::npos);
  EXPECT_GT(surface.covered_border(), 0.3);
}

TEST(MovingSurface, BeginsWithWhatOfItLiesInTheVolume) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}};
  options.box = some_box();
  const Vector<3> corner = options.box->index_to_world * Vector<3>(-0.5, -0.5, -0.5);
  MovingSurface surface(ball(corner, 3, 0.6), options);
  expect_sound(surface);
  EXPECT_NEAR(surface.geometry().enclosed(), std::numbers::pi * 4 / 3 * 27 / 8, 0.2);
  // Three quarters of discs, by chords of at most 0.8: each lacks up to h^2 / (12 R) of its arc.
  EXPECT_NEAR(surface.covered_border() * options.box->border_measure(), std::numbers::pi * 27 / 4,
              3 * 0.8 * 0.8 / 36 * 4.72);
  EXPECT_THROW(MovingSurface(ball({40, 0, 0}, 3, 0.6), options), InvalidMesh);
}

// What lies on a face stays on it while the mesh is mended.
TEST(MovingSurface, KeepsTheLineWhereItEndsOnTheBorder) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}};
  options.box = some_box();
  const Vector<3> face = options.box->index_to_world * Vector<3>(-0.5, 10, 10);
  MovingSurface surface(ball(face, 4, 0.6), options);
  const double covered = surface.covered_border(), enclosed = surface.geometry().enclosed();
  for (int k = 0; k < 10; ++k) {
    const Points<3> X = surface.geometry().points();
    step(surface, along_faces(*options.box, X, 1e-3 * random_field(X, 5 + k, 1)));
    expect_sound(surface);
  }
  // Ten steps of about 1e-3, all the same way, on a disc and half a ball of radius 4.
  EXPECT_NEAR(surface.covered_border(), covered, 2 * 0.01 / 4 * covered);
  EXPECT_NEAR(surface.geometry().enclosed(), enclosed, 3 * 0.01 / 4 * enclosed);
}

TEST(MovingSurface, IsStoppedOnItsWayToHeldPoints) {
  MovingSurfaceOptions options{.edge_length_mm = 0.5, .box = {}};
  options.held_distance_mm = 0.25;
  options.held_points = {{{3, 0, 0}, true}};
  const auto is_held = [&] {
    const MovingSurface surface(ball({0, 0, 0}, 2, 0.5), options);
    return bool(are_held<3>(surface.simplices(), options.held_points, 0.25, {}).front());
  };
  EXPECT_TRUE(is_held());
  std::stop_source stop;
  stop.request_stop();
  options.stop = stop.get_token();
  EXPECT_FALSE(is_held());
}

TEST(MovingSurface, ReportsThatItVanished) {
  MovingSurface surface(ball({0, 0, 0}, 2, 0.5),
                        {.edge_length_mm = 0.5, .box = {}, .min_radius = 2});
  EXPECT_EQ(surface.obstacle(), "");
  for (int k = 0; k < 12; ++k) step(surface, -0.1 * normals(surface));
  EXPECT_TRUE(
      surface.obstacle().starts_with("the object vanished: little was left with its volume"))
      << surface.obstacle();
  EXPECT_TRUE(surface.obstacle().ends_with(", too little for edges of 0.5 mm"))
      << surface.obstacle();
}

// Two balls that grow towards each other would intersect; they are held apart instead.
TEST(MovingSurface, HoldsSheetsApartThatWouldTouch) {
  Triangles two = ball({0, 0, 0}, 1, 0.3);
  const Triangles other = ball({2.6, 0, 0}, 1, 0.3);
  const int n = static_cast<int>(two.points.rows());
  Triangles both{Points<3>(n + other.points.rows(), 3),
                 Elements<3>(two.elements.rows() + other.elements.rows(), 3)};
  both.points << two.points, other.points;
  both.elements << two.elements, (other.elements.array() + n).matrix();
  MovingSurface surface(both, {.edge_length_mm = 0.3, .box = {}});
  double held = 0;
  for (int k = 0; k < 12; ++k) {
    held += step(surface, 0.08 * normals(surface));
    ASSERT_TRUE(verify(surface.simplices()).passed()) << "step " << k;
  }
  EXPECT_GT(held, 0);
  EXPECT_EQ(measure_components(surface.simplices()).size(), 2u);
}

// Fields that tear, fold and press together; a new one every tenth step.
TEST(MovingSurface, DoesNotIntersectItselfInRandomFields) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Triangles start = seed % 2 ? ball({0, 0, 0}, 1.2, 0.35) : torus(1.2, 0.5, 24, 10);
    MovingSurfaceOptions options{.edge_length_mm = 0.35, .box = {}};
    options.box = ImageBox<3>{{5, 5, 5},
                              Eigen::Affine3d(Eigen::Translation3d(-2, -2, -2)),
                              Eigen::Affine3d(Eigen::Translation3d(2, 2, 2))};
    MovingSurface surface(start, options);
    double travelled = 0;
    for (int k = 0; k < 100; ++k) {
      const Points<3> X = surface.geometry().points();
      Points<3> to = X + random_field(X, 100 * seed + k / 10, 0.08);
      surface.restrict_move(to);
      travelled += (to - X).rowwise().norm().mean();
      surface.move_to(to);
      ASSERT_TRUE(self_intersections(surface.simplices()).empty()) << seed << ", step " << k;
      surface.mend();
      ASSERT_TRUE(self_intersections(surface.simplices()).empty()) << seed << ", mended " << k;
    }
    EXPECT_GT(travelled, 1) << seed;  // [mm], of about 10 that the fields ask for
  }
}

// Smooth random motion of surfaces of varying resolution.
TEST(MovingSurface, KeepsGoodTrianglesWhereResolutionVaries) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    MovingSurfaceOptions options{.edge_length_mm = 0.08, .coarseness = 6, .box = {}};
    options.adaptivity.geometry_tolerance_mm = 0.15;
    MovingSurface surface(seed % 2 ? ball({0, 0, 0}, 1.2, 0.2) : torus(1.2, 0.5, 36, 16), options);
    double longest = 0, shortest = 1e9;
    for (int k = 0; k < 40; ++k) {
      const Points<3> X = surface.geometry().points();
      step(surface, random_field(X, 100 * seed + k / 10, 0.02));
      ASSERT_TRUE(verify(surface.simplices()).passed()) << seed << ", step " << k;
      const Quality triangles = quality(surface.simplices());
      ASSERT_GE(triangles.min_angle_deg, 15) << seed << ", step " << k;
      ASSERT_GE(triangles.share_above_25_deg, 0.99) << seed << ", step " << k;
      longest = std::max(longest, triangles.max_edge_mm);
      shortest = std::min(shortest, triangles.min_edge_mm);
    }
    EXPECT_GT(longest, 4 * shortest) << seed;
  }
}

TEST(MovingSurface, SaysThatTheNumberOfTrianglesHasLimitedIt) {
  MovingSurfaceOptions options{.edge_length_mm = 0.1, .box = {}};
  EXPECT_FALSE(MovingSurface(ball({0, 0, 0}, 1, 0.2), options).is_limited());
  options.adaptivity.max_elements = 500;
  EXPECT_TRUE(MovingSurface(ball({0, 0, 0}, 1, 0.3), options).is_limited());
}

// Vertices that jitter by as much as a step allows: every triangle may fold onto a neighbour.
/// Two balls side by side, 0.2 apart.
Triangles two_balls() { return joined({ball({-1.1, 0, 0}, 1, 0.2), ball({1.1, 0, 0}, 1, 0.2)}); }

TEST(MovingSurface, MergesShellsThatMeetUnlessItsTopologyIsFixed) {
  for (const auto& [topology, n_shells] :
       {std::pair{Topology::kFree, 1u}, {Topology::kGenus0, 1u}, {Topology::kFixed, 2u}}) {
    MovingSurface surface(two_balls(), {.edge_length_mm = 0.2, .topology = topology, .box = {}});
    std::vector<flow::TopologyEvent> events;
    for (int k = 0; k < 12; ++k) {
      step(surface, 0.05 * normals(surface));
      for (const auto& event : surface.take_events()) events.push_back(event);
      expect_sound(surface);
    }
    EXPECT_EQ(measure_components(surface.simplices()).size(), n_shells);
    EXPECT_EQ(events.empty(), topology == Topology::kFixed);
    if (events.empty()) continue;
    EXPECT_EQ(events[0].kind, flow::TopologyChange::kMerging);
    EXPECT_FALSE(surface.mend() && surface.has_changed_domain()) << "nothing has moved since";
    EXPECT_LT(events[0].place.norm(), 0.2);
  }
}

TEST(MovingSurface, SplitsWhereANeckCloses) {
  Triangles dumbbell = ellipsoid({0, 0, 0}, Eigen::Vector3d(3, 1, 1).asDiagonal(), 0.2);
  for (auto row : dumbbell.points.rowwise())
    row.tail<2>() *= 1 - 0.6 * std::exp(-row[0] * row[0] / 0.3);
  MovingSurface surface(dumbbell, {.edge_length_mm = 0.2, .topology = Topology::kFree, .box = {}});
  for (int k = 0; k < 12; ++k) {
    step(surface, -0.04 * normals(surface));
    expect_sound(surface);
  }
  EXPECT_EQ(measure_components(surface.simplices()).size(), 2u);
}

TEST(MovingSurface, HoldsApartWhatWouldBeAHandle) {
  // A ring with a gap, which closes as it grows.
  const auto ring = [] {
    Triangles surface = ellipsoid({0, 0, 0}, Eigen::Vector3d(2.9, 0.35, 0.35).asDiagonal(), 0.15);
    for (auto row : surface.points.rowwise()) {
      const double angle = row[0], r = 1 + row[1];
      row[0] = r * std::cos(angle);
      row[1] = r * std::sin(angle);
    }
    surface.elements.col(1).swap(surface.elements.col(2));  // the map turns surfaces inside out
    return surface;
  };
  for (const auto& [topology, genus] :
       {std::pair{Topology::kFree, 1}, {Topology::kGenus0, 0}, {Topology::kFixed, 0}}) {
    MovingSurface surface(ring(), {.edge_length_mm = 0.15, .topology = topology, .box = {}});
    for (int k = 0; k < 10; ++k) {
      step(surface, 0.04 * normals(surface));
      expect_sound(surface);
    }
    const auto parts = measure_components(surface.simplices());
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].genus(), genus);
  }
}

TEST(MovingSurface, BeginsWithTheUnionOfBallsThatOverlap) {
  Triangles both = two_balls();
  for (auto row : both.points.rowwise()) row[0] -= std::copysign(0.3, row[0]);
  MovingSurface surface(both, {.edge_length_mm = 0.2, .topology = Topology::kFree, .box = {}});
  expect_sound(surface);
  EXPECT_EQ(measure_components(surface.simplices()).size(), 1u);
}

TEST(MovingSurface, DoesNotFoldUnderNoise) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    MovingSurface surface(ball({0, 0, 0}, 1, 0.25), {.edge_length_mm = 0.25, .box = {}});
    std::srand(seed);
    for (int k = 0; k < 25; ++k) {
      const Eigen::Index n = surface.geometry().n_vertices();
      step(surface, 0.12 * Points<3>::Random(n, 3));
      ASSERT_TRUE(self_intersections(surface.simplices()).empty()) << seed << ", step " << k;
    }
  }
}

// A ball pressed flat onto the border: what is clamped stays a surface.
TEST(MovingSurface, DoesNotIntersectItselfAtTheBorderOfTheVolume) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}};
  options.box = some_box();
  MovingSurface surface(ball({0, 0, 0}, 3, 0.6), options);
  for (int k = 0; k < 40; ++k) {
    const Points<3> X = surface.geometry().points();
    Points<3> towards = 0.2 * normals(surface);
    towards.rowwise() += Eigen::RowVector3d(0.1, 0.25, 0.05);
    step(surface, towards + random_field(X, 7 + k / 5, 0.1));
    ASSERT_TRUE(self_intersections(surface.simplices()).empty()) << "step " << k;
  }
  EXPECT_GT(surface.border_share(), 0.15);  // else nothing was tried
}

// Surgery joins two halves of balls on a face of the box, whose vertices it sets anew. Those beyond
// the face came back with the next move, however short: so no step made the energy fall.
TEST(MovingSurface, SurgeryAtTheBorderStaysInTheVolume) {
  MovingSurfaceOptions options{.edge_length_mm = 0.6, .box = {}};
  options.topology = Topology::kFree;
  options.box = some_box();
  int n_events = 0;
  for (const double first : {-0.5, 20.5}) {
    const Vector<3> one = options.box->index_to_world * Vector<3>(first, 5, 10),
                    other = options.box->index_to_world * Vector<3>(first, 15, 10);
    MovingSurface surface(joined({ball(one, 2, 0.6), ball(other, 2, 0.6)}), options);
    for (int k = 0; k < 20; ++k) {
      const Points<3> X = surface.geometry().points();
      step(surface,
           0.12 * normals(surface) + along_faces(*options.box, X, random_field(X, k, 0.05)));
      n_events += int(surface.take_events().size());
      const Points<3> now = surface.geometry().points();
      Points<3> to = now;
      surface.restrict_move(to);
      ASSERT_LT((to - now).rowwise().norm().maxCoeff(), 1e-9) << "step " << k;
    }
    expect_sound(surface);
  }
  EXPECT_GE(n_events, 2);
}

TEST(MovingSurface, RefusesOptionsAndSurfacesThatAreWrong) {
  const Triangles start = ball({0, 0, 0}, 1, 0.5);
  EXPECT_THROW(MovingSurface(start, {.edge_length_mm = 0, .box = {}}), UsageError);
  EXPECT_THROW(MovingSurface(start, {.max_displacement_mm = -2, .box = {}}), UsageError);
  EXPECT_THROW(MovingSurface(start, {.sheet_distance = -1, .box = {}}), UsageError);
  Triangles open = start;
  open.elements.conservativeResize(open.elements.rows() - 1, 3);
  EXPECT_THROW(MovingSurface(open, {}), InvalidMesh);
}

/// How many of its vertices are where one of the others is.
Eigen::Index n_in_both(const Triangles& one, const Triangles& other) {
  std::set<std::array<double, 3>> places;
  for (const auto& x : other.points.rowwise()) places.insert({x[0], x[1], x[2]});
  Eigen::Index n = 0;
  for (const auto& x : one.points.rowwise()) n += places.contains({x[0], x[1], x[2]});
  return n;
}

TEST(MovingSurface, MovesInItsRegionOnly) {
  const auto region = std::make_shared<Neighbourhood<3>>(1.0);
  region->add({0, 0, 5});
  MovingSurfaceOptions options;
  options.edge_length_mm = 0.6;
  options.region = region;
  MovingSurface surface(ball({0, 0, 0}, 5, 0.6), options);
  const Triangles before = surface.simplices();
  for (int k = 0; k < 5; ++k) {
    const fem::Geometry<3> part = surface.geometry();
    EXPECT_LT(part.n_vertices(), before.points.rows() / 3);
    step(surface, 0.05 * part.directions());
  }
  EXPECT_NEAR(surface.geometry().radius(), 5, 0.1) << "that of the whole";
  const Triangles after = surface.simplices();
  EXPECT_EQ(surface.size().n_elements, after.elements.rows());
  EXPECT_NEAR(surface.size().enclosed, volume_mm3(after), 1e-9);
  EXPECT_TRUE(verify(after).passed());
  EXPECT_GT(after.points.col(2).maxCoeff(), 5.2);
  EXPECT_GT(n_in_both(after, before), before.points.rows() * 2 / 3) << "bit for bit";
  for (const auto& x : after.points.rowwise())
    if (x[2] < 3.5) {  // what has moved may have left the region sideways
      EXPECT_NEAR(x.norm(), 5, 0.02);
    }
}

// Triangles as thin as the grid cuts them stayed where surgery went beyond the region.
TEST(MovingSurface, MendsWhatSurgeryMakesBeyondItsRegion) {
  Triangles balls = ball({0, 0, 0}, 5, 0.9);
  const Triangles other = ball({6.1, 0.2, 0.3}, 5, 0.9);
  const Eigen::Index n = balls.points.rows(), m = balls.elements.rows();
  balls.points.conservativeResize(n + other.points.rows(), 3);
  balls.points.bottomRows(other.points.rows()) = other.points;
  balls.elements.conservativeResize(m + other.elements.rows(), 3);
  balls.elements.bottomRows(other.elements.rows()) = other.elements.array() + int(n);
  MovingSurfaceOptions options;
  options.topology = Topology::kFree;
  options.edge_length_mm = 0.9;
  const auto region = std::make_shared<Neighbourhood<3>>(0.9);
  region->add({3, 0, 4});  // a part of where they cross
  options.region = region;
  const MovingSurface surface(balls, options);
  const Verification verification = verify(surface.simplices());
  EXPECT_TRUE(verification.passed()) << verification.message();
  EXPECT_GT(verification.min_angle_deg, 15);
  EXPECT_FALSE(region->contains({3, 0, -4}));
}

}  // namespace
}  // namespace surf::mesh
