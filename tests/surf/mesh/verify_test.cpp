#include "libsurf/mesh/verify.h"

#include <gtest/gtest.h>

#include <limits>

#include "libsurf/io/write_surface.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;

TEST(Verify, PassesClosedSurfacesOfAnyGenus) {
  for (const Triangles& surface :
       {tetrahedron(), cube(), sphere({10, -200, 3}, 50, 4), torus(3, 1, 40, 20)}) {
    const Verification found = verify(surface);
    EXPECT_TRUE(found.passed()) << found.message();
    EXPECT_EQ(found.n_components, 1);
    EXPECT_EQ(found.n_triangles, surface.elements.rows());
    EXPECT_GT(found.min_angle_deg, 10);
  }
}

TEST(Verify, SmallestAngleOfTheCubeIs45Degrees) {
  constexpr double kTolerance = 1e-12;  // rounding of atan2
  EXPECT_NEAR(verify(cube()).min_angle_deg, 45, kTolerance);
}

TEST(Verify, RefusesAnEmptySurface) {
  const Verification found = verify({});
  EXPECT_FALSE(found.passed());
  EXPECT_FALSE(found.closed);
  EXPECT_EQ(found.message(), "no triangles");
}

TEST(Verify, RefusesMissingAndNonFinitePoints) {
  Triangles surface = cube();
  surface.elements(3, 1) = 8;
  surface.elements(4, 1) = -1;
  EXPECT_EQ(verify(surface).n_invalid, 2);
  surface = tetrahedron();
  surface.points(3, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(verify(surface).n_invalid, 3);
  EXPECT_FALSE(verify(surface).passed());
}

TEST(Verify, FindsTheBorderOfAnOpenSurface) {
  const Verification found = verify(without_triangle(sphere({0, 0, 0}, 1, 2), 5));
  EXPECT_FALSE(found.passed());
  EXPECT_FALSE(found.closed);
  EXPECT_FALSE(found.outward);
  EXPECT_TRUE(found.manifold);
  EXPECT_EQ(found.n_border_edges, 3);
  EXPECT_EQ(found.border_edges.size(), 3u);
  EXPECT_NE(found.message().find("3 border edges (first: vertices"), std::string::npos);
}

TEST(Verify, FindsNormalsThatPointInward) {
  const Verification found = verify(flipped(torus(3, 1, 20, 10)));
  EXPECT_TRUE(found.closed && found.manifold);
  EXPECT_FALSE(found.outward);
  EXPECT_EQ(found.n_inverted_components, 1);
}

TEST(Verify, FindsOneTriangleThatIsFlipped) {
  Triangles surface = cube();
  std::swap(surface.elements(5, 0), surface.elements(5, 1));
  const Verification found = verify(surface);
  EXPECT_FALSE(found.outward);
  EXPECT_EQ(found.n_misoriented_edges, 3);
}

TEST(Verify, CannotOrientAKleinBottle) {
  const Verification found = verify(klein_bottle(24, 12));
  EXPECT_TRUE(found.closed && found.manifold);
  EXPECT_FALSE(found.outward);
  EXPECT_GT(found.n_misoriented_edges, 0);
}

TEST(Verify, NestedShellsAlternate) {
  const Triangles outer = sphere({0, 0, 0}, 3, 3), cavity = flipped(sphere({0, 0, 0}, 2, 3)),
                  core = sphere({0, 0, 0}, 1, 3), other = sphere({10, 0, 0}, 1, 3);
  const Triangles good = joined(joined(core, outer), joined(other, cavity));
  EXPECT_TRUE(verify(good).passed()) << verify(good).message();
  EXPECT_EQ(verify(good).n_components, 4);
  EXPECT_EQ(verify(joined(outer, flipped(cavity))).n_inverted_components, 1);
  EXPECT_EQ(verify(joined(outer, flipped(core))).n_inverted_components, 0);
  EXPECT_EQ(verify(joined(outer, flipped(other))).n_inverted_components, 1);
  EXPECT_EQ(verify(flipped(good)).n_inverted_components, 4);
}

// Rays from the extreme vertex run through vertices and edges of the other shell.
TEST(Verify, NestsShellsWhoseRaysHitEdges) {
  const Triangles small =
      moved(cube(), Eigen::Translation3d(0.25, 0.25, 0.25) * Eigen::Affine3d(Eigen::Scaling(0.5)));
  const Triangles octahedron = sphere({0, 0, 0}, 4, 0), inner = sphere({0, 0, 0}, 1, 0);
  EXPECT_TRUE(verify(joined(cube(), flipped(small))).passed());
  EXPECT_TRUE(verify(joined(octahedron, flipped(inner))).passed());
  EXPECT_FALSE(verify(joined(octahedron, inner)).passed());
}

TEST(Verify, TwoCubesThatShareAnEdgeAreNotManifold) {
  const Verification found = verify(welded(joined(cube(), moved(cube(), {1, 1, 0}))));
  EXPECT_FALSE(found.manifold);
  EXPECT_EQ(found.n_nonmanifold_edges, 1);
  EXPECT_EQ(found.n_nonmanifold_vertices, 0);  // the fans hang together by the edge
}

TEST(Verify, ChambersThatShareAWallEncloseNoVolume) {
  const Triangles cubes = welded(joined(cube(), moved(cube(), {1, 0, 0})));  // the wall twice
  Triangles chambers{cubes.points, Elements<3>(cubes.elements.rows() - 2, 3)};
  int n = 0, n_of_wall = 0;
  for (const auto t : cubes.elements.rowwise()) {
    const bool is_wall = (cubes.points(t, 0).array() == 1).all();
    if (!is_wall || ++n_of_wall <= 2) chambers.elements.row(n++) = t;
  }
  ASSERT_EQ(n, chambers.elements.rows());
  const Verification found = verify(chambers);
  EXPECT_TRUE(found.closed);
  EXPECT_EQ(found.n_misoriented_edges, 0);
  EXPECT_EQ(found.n_unbalanced_edges, 4);
  EXPECT_FALSE(found.is_solid());
  const Verification twice = verify(welded(joined(cube(), moved(cube(), {1, 1, 0}))));
  EXPECT_EQ(twice.n_unbalanced_edges, 0);
  EXPECT_TRUE(twice.is_solid()) << "each of the cubes does";
}

TEST(Verify, TwoCubesThatShareAVertexAreNotManifold) {
  const Triangles cubes = welded(joined(cube(), moved(cube(), {1, 1, 1})));
  const Verification found = verify(cubes);
  EXPECT_TRUE(found.closed);
  EXPECT_FALSE(found.manifold);
  EXPECT_EQ(found.n_nonmanifold_edges, 0);
  EXPECT_EQ(found.n_nonmanifold_vertices, 1);
  ASSERT_EQ(found.nonmanifold_vertices.size(), 1u);
  EXPECT_EQ(cubes.points.row(found.nonmanifold_vertices[0]), Eigen::RowVector3d(1, 1, 1));
  EXPECT_EQ(found.n_components, 2);
}

TEST(Verify, CubesThatTouchWithoutSharedVerticesIntersect) {
  for (const Vector<3>& by : {Vector<3>(1, 0, 0), Vector<3>(1, 1, 0), Vector<3>(1, 1, 1)}) {
    const Verification found = verify(joined(cube(), moved(cube(), by)));
    EXPECT_TRUE(found.manifold);
    EXPECT_GT(found.n_self_intersections, 0);
    EXPECT_FALSE(found.passed());
  }
}

TEST(Verify, FindsADegenerateTriangle) {
  Triangles surface = cube();
  surface.points.row(3) = (surface.points.row(1) + surface.points.row(2)) / 2;  // still closed
  const auto is_flat = [](const Verification& found) { return found.n_degenerate > 0; };
  EXPECT_FALSE(is_flat(verify(surface)));
  surface.points.row(3) = (surface.points.row(0) + surface.points.row(2)) / 2;
  const Verification found = verify(surface);
  EXPECT_EQ(found.n_degenerate, 1);
  EXPECT_EQ(found.degenerate, std::vector<int>{0});
  EXPECT_FALSE(found.passed());
}

TEST(Verify, FindsATriangleThatNamesAVertexTwice) {
  Triangles surface = tetrahedron();
  surface.elements.conservativeResize(5, 3);
  surface.elements.row(4) << 1, 1, 2;
  const Verification found = verify(surface);
  EXPECT_FALSE(found.passed());
  EXPECT_EQ(found.n_degenerate, 1);
  EXPECT_TRUE(found.closed && found.is_solid()) << "from 1 to 1 there is no border";
}

// As marching cubes leaves them where the surface passes through a node of the grid.
TEST(Verify, TrianglesWithTwoEqualCornersDoNotOpenASolid) {
  Triangles surface = sphere({0, 0, 0}, 1, 3);
  surface.points.row(surface.elements(5, 1)) = surface.points.row(surface.elements(5, 0)).eval();
  surface = welded(surface);
  const Verification found = verify(surface);
  EXPECT_TRUE(found.closed && found.is_solid()) << found.message();
  EXPECT_EQ(found.n_degenerate, 2);
  EXPECT_FALSE(found.passed() || found.manifold || found.outward);
  EXPECT_EQ(found.n_inverted_components, 0);
  EXPECT_EQ(verify(flipped(surface)).n_inverted_components, 1);
}

TEST(Verify, SurvivesAnyTrianglesAtAll) {
  unsigned state = 7;
  const auto random = [&](int n) {
    state = state * 1664525u + 1013904223u;
    return static_cast<int>((state >> 8) % n);
  };
  for (int trial = 0; trial < 200; ++trial) {
    Triangles soup;
    soup.points.resize(6, 3);
    for (double& x : soup.points.reshaped()) x = random(3);
    soup.elements.resize(1 + random(12), 3);
    for (int& vertex : soup.elements.reshaped()) vertex = random(6);
    const Verification found = verify(soup);
    EXPECT_FALSE(found.message().empty());
    EXPECT_TRUE(!found.passed() || soup.elements.rows() >= 4);
  }
}

// Two sheets 1e-6 apart at 100 mm are clear of each other in double, not in float32.
TEST(Verify, RoundingToTheFilesFloatsCanMakeAnIntersection) {
  const Triangles surface =
      joined(moved(cube(), {100, 0, 0}), moved(cube(), {101 + 1e-6, 0.25, 0.25}));
  EXPECT_TRUE(verify(surface).passed());
  EXPECT_TRUE(verify(io::rounded_to_file(surface, ".vtp")).passed());
  for (const char* extension : {".stl", ".obj", ".ply"}) {
    const Verification found = verify(io::rounded_to_file(surface, extension));
    EXPECT_GT(found.n_self_intersections, 0) << extension;
    EXPECT_FALSE(found.passed());
  }
}

}  // namespace
}  // namespace surf::mesh
