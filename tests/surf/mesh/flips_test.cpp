#include "libsurf/mesh/detail/flips.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libsurf/base/threads.h"
#include "libsurf/mesh/primitives.h"
#include "tests/surf/mesh/check_shapes.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// A prism over a rhombus whose long diagonals, 0-3 below and 4-7 above, are edges; the corners 1
/// and 2 lie lower by `bend`.
Triangles prism(double bend) {
  Triangles out = test::cube();
  Eigen::Matrix3d stretch = Eigen::Matrix3d::Identity();
  stretch.topLeftCorner<2, 2>() << 1.5, 0.5, 0.5, 1.5;  // by 2 along (1, 1)
  out.points = (out.points * stretch).eval();
  for (const int i : {1, 2}) out.points(i, 2) -= bend;
  return out;
}

ImproveOptions options() {
  return {.min_length = 0.01, .max_length = 1, .tolerance_mm = 1e-6, .min_angle_deg = 30};
}

bool has_edge(const TriMesh& mesh, int a, int b) {
  return mesh.find_halfedge(VertexHandle(a), VertexHandle(b)).is_valid();
}

TEST(Flips, TakesTheShorterDiagonalsOfFlatRhombi) {
  TriMesh mesh = to_mesh(prism(0));
  const double volume = enclosed_volume(mesh), area = surface_area(mesh);
  const ImproveOptions flat = options();
  Mending work(mesh, flat);
  Flips(work).flip_edges();
  EXPECT_EQ(work.report.n_flipped, 2);
  EXPECT_TRUE(has_edge(mesh, 1, 2) && has_edge(mesh, 5, 6));
  EXPECT_FALSE(has_edge(mesh, 0, 3) || has_edge(mesh, 4, 7));
  EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-14);
  EXPECT_NEAR(surface_area(mesh), area, 1e-14);
  EXPECT_EQ(std::count(work.is_reconnected.begin(), work.is_reconnected.end(), true), 4);
  check_mesh(mesh);
  Flips(work).flip_edges();
  EXPECT_EQ(work.report.n_flipped, 2);  // nothing left to do
}

// Diagonals of a bent rhombus are `bend` apart.
TEST(Flips, GoNoFurtherThanTheTolerance) {
  for (const double tolerance : {0.9e-2, 1.1e-2}) {
    TriMesh mesh = to_mesh(prism(1e-2));
    ImproveOptions bent = options();
    bent.tolerance_mm = tolerance;
    Mending work(mesh, bent);
    Flips(work).flip_edges();
    EXPECT_TRUE(has_edge(mesh, 5, 6));
    EXPECT_EQ(has_edge(mesh, 1, 2), tolerance > 1e-2);
    check_mesh(mesh);
  }
}

// Of two steps, each within the tolerance, the second would leave the surface at the start.
TEST(Flips, RememberTheSurfaceAtTheStart) {
  TriMesh mesh = to_mesh(prism(0));
  ImproveOptions tight = options();
  tight.tolerance_mm = 1e-2;
  Mending work(mesh, tight);
  const EdgeHandle below = mesh.edge_handle(mesh.find_halfedge(VertexHandle(0), VertexHandle(3)));
  ASSERT_TRUE(Flips(work).try_flip(below));
  // The middle of the old diagonal is a witness: with the corners pulled away from it there is no
  // flip that a tolerance of less than its distance allows.
  for (const int i : {0, 1, 2, 3}) mesh.point(VertexHandle(i))[2] -= 0.05;
  mesh.point(VertexHandle(0))[2] += 2e-2;
  const EdgeHandle now = mesh.edge_handle(mesh.find_halfedge(VertexHandle(1), VertexHandle(2)));
  EXPECT_FALSE(Flips(work).try_flip(now));
}

TEST(Flips, LeaveFrozenFacesAlone) {
  TriMesh mesh = to_mesh(prism(0));
  ImproveOptions frozen = options();
  frozen.frozen.assign(mesh.n_faces(), 0);
  frozen.frozen[0] = 1;  // below
  Mending work(mesh, frozen);
  Flips(work).flip_edges();
  EXPECT_EQ(work.report.n_flipped, 1);
  EXPECT_TRUE(has_edge(mesh, 0, 3));
  EXPECT_TRUE(has_edge(mesh, 5, 6));
}

TEST(Flips, NeverLowerTheSmallestAngle) {
  TriMesh mesh = to_mesh(prism(0));
  const ImproveOptions flat = options();
  Mending work(mesh, flat);
  Flips flips(work);
  for (const auto edge : mesh.edges()) {
    const double before = angles_deg(mesh).minCoeff();
    flips.try_flip(edge);
    EXPECT_GE(angles_deg(mesh).minCoeff(), before - 1e-12);
    check_mesh(mesh);
  }
}

// What is planned ahead on several threads is what would be planned in its turn.
TEST(Flips, AreTheSameOnOneThreadAndOnFour) {
  const auto flipped = [](int n_threads) {
    const ThreadLimit limit(n_threads);
    Triangles sheared = ball({0, 0, 0}, 1, 0.05);
    Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
    shear(1, 0) = 1.5;  // its triangles are far from Delaunay
    sheared.points = (sheared.points * shear).eval();
    TriMesh mesh = to_mesh(sheared);
    ImproveOptions wide = options();
    wide.tolerance_mm = 0.02;
    Mending work(mesh, wide);
    Flips(work).flip_edges();
    EXPECT_GT(work.report.n_flipped, 1500);
    return to_triangles(mesh);
  };
  const Triangles one = flipped(1), four = flipped(4);
  EXPECT_EQ(one.elements, four.elements);
}

}  // namespace
}  // namespace surf::mesh
