#include "libsurf/mesh/detail/collapses.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/surf/mesh/check_shapes.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using CollapseFor = Collapses::CollapseFor;
const double kCosBound = std::cos(15 * std::numbers::pi / 180);

ImproveOptions options(double tolerance_mm) {
  return {.min_length = 0.1, .max_length = 2, .tolerance_mm = tolerance_mm};
}

bool is_on_top(const TriMesh& mesh, VertexHandle vertex) {
  for (const VertexHandle other : mesh.vv_range(vertex))
    if (mesh.point(other)[2] != 1) return false;
  return true;
}

/// An edge whose stars lie in the face z = 1 of a box.
EdgeHandle edge_on_top(const TriMesh& mesh) {
  for (const auto edge : mesh.edges()) {
    const HalfedgeHandle h = mesh.halfedge_handle(edge, 0);
    if (is_on_top(mesh, mesh.from_vertex_handle(h)) && is_on_top(mesh, mesh.to_vertex_handle(h)))
      return edge;
  }
  return EdgeHandle();
}

TEST(Collapses, InAPlaneLeaveTheSurfaceWhereItIs) {
  TriMesh mesh = to_mesh(box({0, 0, 0}, {1, 1, 1}, 0.2));
  const double volume = enclosed_volume(mesh), area = surface_area(mesh);
  const ImproveOptions exact = options(1e-9);
  Mending work(mesh, exact);
  ASSERT_TRUE(Collapses(work).try_collapse(edge_on_top(mesh), kCosBound, CollapseFor::kLength));
  EXPECT_EQ(work.report.n_collapsed, 1);
  const std::size_t n_faces = mesh.n_faces();
  mesh.garbage_collection();
  EXPECT_EQ(mesh.n_faces(), n_faces - 2);
  check_mesh(mesh);
  EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-12);
  EXPECT_NEAR(surface_area(mesh), area, 1e-12);
}

TEST(Collapses, KeepTheVolumeOfABallAndItsTolerance) {
  for (const double tolerance : {1e-4, 0.1}) {
    TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.3));
    const double volume = enclosed_volume(mesh);
    const ImproveOptions some = options(tolerance);
    Mending work(mesh, some);
    const bool is_done =
        Collapses(work).try_collapse(EdgeHandle(0), kCosBound, CollapseFor::kLength);
    EXPECT_EQ(is_done, tolerance == 0.1);
    mesh.garbage_collection();
    check_mesh(mesh);
    EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-12);
  }
}

TEST(Collapses, LeaveFrozenStarsAlone) {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.3));
  ImproveOptions frozen = options(0.1);
  const EdgeHandle edge(0);
  const VertexHandle end = mesh.to_vertex_handle(mesh.halfedge_handle(edge, 0));
  frozen.frozen.assign(mesh.n_faces(), 0);
  frozen.frozen[(*mesh.cvf_iter(end)).idx()] = 1;
  Mending work(mesh, frozen);
  EXPECT_FALSE(Collapses(work).try_collapse(edge, kCosBound, CollapseFor::kLength));
  EXPECT_EQ(work.report.n_collapsed, 0);
}

TEST(Collapses, LeaveNoVertexWithTwoTriangles) {
  TriMesh mesh = to_mesh(test::tetrahedron());
  const ImproveOptions loose = options(10);
  Mending work(mesh, loose);
  for (const auto edge : mesh.edges())
    EXPECT_FALSE(Collapses(work).try_collapse(edge, 1, CollapseFor::kLength));
  check_mesh(mesh);
}

// One vertex has been moved to a tenth of an edge from another one.
TEST(Collapses, RemoveTheShortEdgesAndNoOthers) {
  TriMesh mesh = to_mesh(box({0, 0, 0}, {1, 1, 1}, 0.2));
  const HalfedgeHandle h = mesh.halfedge_handle(edge_on_top(mesh), 0);
  const Eigen::Vector3d from = mesh.point(mesh.from_vertex_handle(h));
  mesh.set_point(mesh.to_vertex_handle(h),
                 from + 0.3 * (mesh.point(mesh.to_vertex_handle(h)) - from));
  const ImproveOptions exact = options(1e-9);
  Mending work(mesh, exact);
  Collapses(work).collapse_short_edges(kCosBound);
  EXPECT_EQ(work.report.n_collapsed, 1);
  mesh.garbage_collection();
  check_mesh(mesh);
  for (const auto edge : mesh.edges()) EXPECT_GE(mesh.calc_edge_length(edge), exact.min_length);
}

TEST(Collapses, CoarsenWhatIsFlaggedAndFlatOnly) {
  TriMesh mesh = to_mesh(box({0, 0, 0}, {1, 1, 1}, 0.2));
  ImproveOptions some = options(1e-9);
  some.max_variation_mm = 1e-6;
  for (const auto face : mesh.faces()) {
    double lowest = 1;
    for (const VertexHandle vertex : mesh.fv_range(face))
      lowest = std::min(lowest, mesh.point(vertex)[2]);
    some.may_coarsen.push_back(lowest == 1);
  }
  const std::size_t n_top = std::count(some.may_coarsen.begin(), some.may_coarsen.end(), 1);
  const double volume = enclosed_volume(mesh);
  Mending work(mesh, some);
  Collapses(work).coarsen(std::cos(25 * std::numbers::pi / 180));
  EXPECT_GT(work.report.n_collapsed, 0);
  EXPECT_LE(2u * work.report.n_collapsed, n_top);
  mesh.garbage_collection();
  check_mesh(mesh);
  EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-12);
}

}  // namespace
}  // namespace surf::mesh
