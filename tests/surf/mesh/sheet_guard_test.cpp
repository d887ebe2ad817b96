#include "libsurf/mesh/sheet_guard.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// Two plates of 6 x 6 squares of side 1 at z = -gap/2 and gap/2 whose normals face each other.
Triangles plates(double gap) {
  constexpr int kSide = 7;
  Triangles out{Points<3>(2 * kSide * kSide, 3), Elements<3>(4 * 36, 3)};
  int t = 0;
  for (int plate = 0; plate < 2; ++plate) {
    const int first = plate * kSide * kSide;
    for (int i = 0; i < kSide; ++i)
      for (int j = 0; j < kSide; ++j)
        out.points.row(first + i * kSide + j) << i, j, plate == 0 ? -gap / 2 : gap / 2;
    for (int i = 0; i + 1 < kSide; ++i)
      for (int j = 0; j + 1 < kSide; ++j) {
        const int a = first + i * kSide + j, b = a + kSide, c = b + 1, d = a + 1;
        if (plate == 0) {
          out.elements.row(t++) << a, b, c;  // normal up
          out.elements.row(t++) << a, c, d;
        } else {
          out.elements.row(t++) << a, c, b;  // normal down
          out.elements.row(t++) << a, d, c;
        }
      }
  }
  return out;
}

Triangles single_triangle() {
  Triangles out{Points<3>(3, 3), Elements<3>(1, 3)};
  out.points << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  out.elements << 0, 1, 2;
  return out;
}

int count(const std::vector<char>& touched) {
  return static_cast<int>(std::count(touched.begin(), touched.end(), 1));
}

int touched_between(double gap_before, double gap_after, double distance) {
  const Triangles from = plates(gap_before), to = plates(gap_after);
  return count(vertices_in_contact(from.points, to.points, from.elements, distance));
}

TEST(SheetGuard, HoldsTwoPlatesThatApproach) {
  EXPECT_EQ(touched_between(1.0, 0.5, 0.7), 2 * 49);  // every vertex
}

TEST(SheetGuard, LeavesPlatesAloneThatArePartedOrFarOrAtRest) {
  EXPECT_EQ(touched_between(0.5, 0.6, 0.7), 0);
  EXPECT_EQ(touched_between(1.0, 0.8, 0.7), 0);
  EXPECT_EQ(touched_between(0.5, 0.5, 0.7), 0);
}

TEST(SheetGuard, HoldsPlatesBackToBackToo) {
  // A thin wall seen from inside the wall's material: normals away from each other.
  Triangles from = plates(1.0), to = plates(0.5);
  from.elements.col(1).swap(from.elements.col(2));
  EXPECT_EQ(count(vertices_in_contact(from.points, to.points, from.elements, 0.7)), 2 * 49);
}

TEST(SheetGuard, LeavesASingleCurvedSheetAlone) {
  for (int kind = 0; kind < 4; ++kind) {
    const Triangles surface = some_surface(kind);
    const Points<3> smaller = 0.9 * surface.points;
    // Sheets of all these bodies are further apart than 0.35; neighbours within it are one sheet.
    EXPECT_EQ(count(vertices_in_contact(surface.points, smaller, surface.elements, 0.25)), 0)
        << kind;
  }
}

/// What the header says, without a grid.
std::vector<char> by_brute_force(const Points<3>& from, const Points<3>& to, const Elements<3>& T,
                                 double distance) {
  const auto centroid = [&](const Points<3>& X, int t) {
    return Vector<3>((X.row(T(t, 0)) + X.row(T(t, 1)) + X.row(T(t, 2))) / 3);
  };
  const auto normal = [&](int t) {
    const Vector<3> a = to.row(T(t, 1)) - to.row(T(t, 0)), b = to.row(T(t, 2)) - to.row(T(t, 0));
    return Vector<3>(a.cross(b).normalized());
  };
  std::vector<char> touched(from.rows(), 0);
  for (int s = 0; s < T.rows(); ++s)
    for (int t = s + 1; t < T.rows(); ++t) {
      bool share = false;
      for (int i = 0; i < 3; ++i) share |= (T.row(t).array() == T(s, i)).any();
      const double gap = (centroid(to, s) - centroid(to, t)).norm();
      const double before = (centroid(from, s) - centroid(from, t)).norm();
      if (share || gap >= distance || gap >= before || normal(s).dot(normal(t)) > -0.2) continue;
      for (int i = 0; i < 3; ++i) touched[T(s, i)] = touched[T(t, i)] = 1;
    }
  return touched;
}

TEST(SheetGuard, AgreesWithBruteForceOnRandomSoups) {
  int n_touched = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> place(-3, 3), jitter(-0.4, 0.4);
    constexpr int kVertices = 240, kTriangles = 150;
    Points<3> from(kVertices, 3), to(kVertices, 3);
    for (int group = 0; group < kVertices / 3; ++group) {
      const Eigen::RowVector3d centre(place(generator), place(generator), place(generator));
      for (int i = 3 * group; i < 3 * group + 3; ++i)
        for (int d = 0; d < 3; ++d) from(i, d) = centre[d] + jitter(generator);
    }
    for (Eigen::Index i = 0; i < to.size(); ++i)
      to.data()[i] = from.data()[i] + 0.5 * jitter(generator);
    Elements<3> T(kTriangles, 3);
    for (int t = 0; t < kTriangles; ++t) {
      const int group = 3 * static_cast<int>(generator() % (kVertices / 3));
      const bool turned = generator() % 2;
      T.row(t) << group, group + (turned ? 2 : 1), group + (turned ? 1 : 2);
    }
    for (const double distance : {0.1, 0.7, 2.0}) {
      const auto touched = vertices_in_contact(from, to, T, distance);
      EXPECT_EQ(touched, by_brute_force(from, to, T, distance)) << seed << ", " << distance;
      n_touched += count(touched);
    }
  }
  EXPECT_GT(n_touched, 1000);
}

TEST(SheetGuard, FindsPairsOnSurfacesFarApart) {
  Triangles from = plates(1.0), to = plates(0.5);
  const Eigen::RowVector3d far(1e5, 2e6, -3e6);
  for (Triangles* surface : {&from, &to}) surface->points.bottomRows(1).rowwise() += far;
  EXPECT_EQ(count(vertices_in_contact(from.points, to.points, from.elements, 0.7)), 2 * 49 - 2);
}

double smallest_angle_deg(const Points<3>& points, const Elements<3>& elements) {
  return quality({points, elements}).min_angle_deg;
}

// Random ways that leave slivers: what is thin afterwards was so before, far ways are shortened and
// short ones go to their end.
TEST(HoldSlivers, ShortensWaysThatMakeTrianglesThin) {
  const Triangles round = ball({0, 0, 0}, 12, 2);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> step(-1.4, 1.4);
  Points<3> to = round.points;
  for (Eigen::Index i = 0; i < to.rows(); ++i)
    for (int axis = 0; axis < 3; ++axis) to(i, axis) += step(random);
  const Points<3> wanted = to;
  ASSERT_LT(smallest_angle_deg(to, round.elements), 8);
  const Eigen::Index n = hold_slivers(round.points, to, round.elements, 20);
  EXPECT_GE(smallest_angle_deg(to, round.elements), 20 - 1e-9);
  EXPECT_GT(n, 10);
  EXPECT_LT(n, to.rows());
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    const double way = (to.row(i) - round.points.row(i)).norm(),
                 wish = (wanted.row(i) - round.points.row(i)).norm();
    EXPECT_LE(way, wish * (1 + 1e-12)) << i;
  }
  Points<3> near = round.points;
  near.array() += 0.01;
  const Points<3> moved = near;
  EXPECT_EQ(hold_slivers(round.points, near, round.elements, 20), 0);
  EXPECT_EQ(near, moved);
}

// What is thin already may stay so, or become less thin.
TEST(HoldSlivers, LetsThinTrianglesOpen) {
  Points<3> from(4, 3), to;
  from << 0, 0, 0, 10, 0, 0, 5, 0.5, 0, 5, -8, 0;
  Elements<3> elements(2, 3);
  elements << 0, 1, 2, 1, 0, 3;
  to = from;
  to(2, 1) = 1;
  const Points<3> wanted = to;
  EXPECT_EQ(hold_slivers(from, to, elements, 20), 0);
  EXPECT_EQ(to, wanted);
  to(2, 1) = 0.25;
  EXPECT_EQ(hold_slivers(from, to, elements, 20), 1);
  EXPECT_EQ(to, from);
}

/// Number of vertices held; what is left has no intersection, and no vertex is elsewhere than at
/// one of its two places.
int held(const Triangles& from, Points<3> to) {
  const Points<3> wanted = to;
  const auto n_held = static_cast<int>(hold_intersecting(from.points, to, from.elements));
  EXPECT_TRUE(self_intersections(Triangles{to, from.elements}).empty());
  int n_back = 0;
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    if (to.row(i) == wanted.row(i)) continue;
    EXPECT_EQ(to.row(i), from.points.row(i)) << i;
    ++n_back;
  }
  EXPECT_EQ(n_back, n_held);
  return n_held;
}

TEST(HoldIntersecting, LetsAStepBeThatKeepsTheSurfaceEmbedded) {
  for (int kind = 0; kind < 4; ++kind) {
    const Triangles surface = some_surface(kind);
    std::mt19937 random(kind);
    const WavyField field(random, 0.05);
    Points<3> to = surface.points;
    for (Eigen::Index i = 0; i < to.rows(); ++i) to.row(i) += field(to.row(i).transpose());
    EXPECT_EQ(held(surface, to), 0) << kind;
  }
}

TEST(HoldIntersecting, HoldsPlatesPushedThroughEachOtherInOneStep) {
  const Triangles from = plates(1);
  Points<3> to = from.points;
  for (Eigen::Index i = 0; i < to.rows(); ++i) {  // the middle of the lower plate, by three gaps
    const double r2 = (to.row(i).head<2>() - Eigen::RowVector2d(3, 3)).squaredNorm();
    if (to(i, 2) < 0) to(i, 2) += 3 * std::exp(-r2);
  }
  const int n_held = held(from, to);
  EXPECT_GT(n_held, 0);
  EXPECT_LT(n_held, 40);  // the rest of the plate moves
}

TEST(HoldIntersecting, HoldsAVertexThatFoldsItsStar) {
  const Triangles from = plates(5);
  Points<3> to = from.points;
  to.row(24) += Eigen::RowVector3d(1.8, 0.3, 0);  // beyond its neighbours, in the plane
  EXPECT_EQ(held(from, to), 1);
  to = from.points;
  to.row(24) += Eigen::RowVector3d(0.4, 0.3, 0);
  EXPECT_EQ(held(from, to), 0);
}

TEST(HoldIntersecting, HoldsTrianglesThatLoseTheirAreaOrTurn) {
  const Triangles from = single_triangle();
  Points<3> to = from.points;
  to.row(2) << 0.5, 0, 0;
  EXPECT_EQ(held(from, to), 1);
  to.row(2) << 0, -1, 0;
  EXPECT_EQ(held(from, to), 1);
  to.row(2) << 0, 0.1, 1;
  EXPECT_EQ(held(from, to), 0);
}

TEST(HoldIntersecting, KeepsASurfaceEmbeddedWhateverTheStep) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Triangles from = some_surface(static_cast<int>(seed));
    std::srand(seed);
    for (const double amplitude : {0.3, 1.0, 5.0})
      EXPECT_GT(held(from, from.points + amplitude * Points<3>::Random(from.points.rows(), 3)), 0)
          << seed;
    EXPECT_GT(held(from, Points<3>::Zero(from.points.rows(), 3)), 0);
  }
}

// Else it could never be undone.
TEST(HoldIntersecting, LetsWhatIntersectedBeforeMoveApart) {
  Triangles crossed = plates(1);
  crossed.points.topRows(49).col(2).array() += 0.3;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).matrix();
  crossed.points.topRows(49) *= turn.transpose();
  ASSERT_FALSE(self_intersections(crossed).empty());
  Points<3> to = crossed.points;
  to.bottomRows(49).col(2).array() += 5;
  EXPECT_EQ(held(crossed, to), 0);
}

}  // namespace
}  // namespace surf::mesh
