#include "libsurf/mesh/triangle_mesh.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <limits>
#include <string>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

Triangles tetrahedron() {
  Triangles result{Points<3>(4, 3), Elements<3>(4, 3)};
  result.points << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  result.elements << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  return result;
}

TEST(TriangleMesh, ArraysGoThroughTheMeshUnchanged) {
  for (int kind = 0; kind < 4; ++kind) {
    const Triangles surface = some_surface(kind);
    const TriMesh mesh = to_mesh(surface);
    check_mesh(mesh);
    const Triangles back = to_triangles(mesh);
    EXPECT_EQ(back.points, surface.points);
    EXPECT_EQ(back.elements, surface.elements);
  }
}

TEST(TriangleMesh, SetPointsMovesEveryVertex) {
  TriMesh mesh = to_mesh(tetrahedron());
  const Points<3> moved = 2 * points(mesh);
  set_points(mesh, moved);
  EXPECT_EQ(points(mesh), moved);
}

TEST(TriangleMesh, PropertiesOfNewVerticesAreZero) {
  TriMesh mesh = to_mesh(tetrahedron());
  OpenMesh::VPropHandleT<Eigen::Vector3d> displacement;
  mesh.add_property(displacement);
  for (int n = 0; n < 100; ++n) {
    for (const auto vertex : mesh.vertices()) mesh.property(displacement, vertex).setOnes();
    const auto added = mesh.add_vertex({1, 2, 3});
    EXPECT_EQ(mesh.property(displacement, added), Eigen::Vector3d::Zero());
    if (n % 2 == 0) continue;
    mesh.delete_vertex(added);
    mesh.garbage_collection();
  }
}

TEST(TriangleMesh, VolumeAndAreaOfATetrahedronAreExact) {
  const TriMesh mesh = to_mesh(tetrahedron());
  EXPECT_NEAR(enclosed_volume(mesh), 1.0 / 6, 1e-15);
  EXPECT_NEAR(surface_area(mesh), 1.5 + std::sqrt(3.0) / 2, 1e-15);
  EXPECT_NEAR(angles_deg(mesh).minCoeff(), 45, 1e-12);
  EXPECT_NEAR(angles_deg(mesh).rowwise().sum().maxCoeff(), 180, 1e-12);
}

struct BrokenSurface {
  const char* name;
  const char* message;  // a part of it
  std::function<void(Triangles&)> break_it;
};

void drop_last_triangle(Triangles& surface) {
  surface.elements.conservativeResize(surface.elements.rows() - 1, 3);
}

void add(Triangles& surface, const Triangles& other, int shared_vertices) {
  const auto n = surface.points.rows(), m = surface.elements.rows();
  surface.points.conservativeResize(n + other.points.rows() - shared_vertices, 3);
  surface.points.bottomRows(other.points.rows() - shared_vertices) =
      other.points.bottomRows(other.points.rows() - shared_vertices);
  surface.elements.conservativeResize(m + other.elements.rows(), 3);
  for (int j = 0; j < other.elements.rows(); ++j)
    for (int corner = 0; corner < 3; ++corner) {
      const int index = other.elements(j, corner);
      surface.elements(m + j, corner) =
          index < shared_vertices ? index : index + static_cast<int>(n) - shared_vertices;
    }
}

TEST(TriangleMesh, RejectsWhatIsNotAClosedOrientedManifold) {
  const BrokenSurface cases[] = {
      {"NaN", "vertex 2 has a coordinate that is NaN",
       [](Triangles& s) { s.points(2, 1) = std::numeric_limits<double>::quiet_NaN(); }},
      {"index", "triangle 1 names vertex 9, but there are 4",
       [](Triangles& s) { s.elements(1, 0) = 9; }},
      {"negative", "names vertex -1", [](Triangles& s) { s.elements(3, 2) = -1; }},
      {"twice", "names a vertex twice", [](Triangles& s) { s.elements(2, 1) = 1; }},
      {"open", "edge (0, 2) of triangle 0 has no other triangle", drop_last_triangle},
      {"orientation", "not consistently oriented",
       [](Triangles& s) { std::swap(s.elements(2, 0), s.elements(2, 1)); }},
      {"edge of four", "edge (0, 1) of triangle", [](Triangles& s) { add(s, tetrahedron(), 2); }},
      {"vertex of two fans", "vertex 0 are not one fan",
       [](Triangles& s) { add(s, tetrahedron(), 1); }},
      {"unused vertex", "vertex 4 is in no triangle",
       [](Triangles& s) {
         s.points.conservativeResize(5, 3);
         s.points.row(4).setZero();
       }},
      {"flat pair", "has only 2 triangles",
       [](Triangles& s) {
         s.points.conservativeResize(3, 3);
         s.elements.conservativeResize(2, 3);
         s.elements << 0, 1, 2, 0, 2, 1;
       }},
  };
  for (const BrokenSurface& broken : cases) {
    Triangles surface = tetrahedron();
    broken.break_it(surface);
    try {
      to_mesh(surface);
      ADD_FAILURE() << broken.name << ": accepted";
    } catch (const InvalidMesh& error) {
      EXPECT_NE(std::string(error.what()).find(broken.message), std::string::npos)
          << broken.name << ": " << error.what();
    }
  }
}

TEST(TriangleMesh, CheckFindsBrokenHalfedgesMarksAndGarbage) {
  {
    TriMesh mesh = to_mesh(tetrahedron());
    mesh.set_halfedge_handle(OpenMesh::FaceHandle(0),
                             mesh.halfedge_handle(OpenMesh::FaceHandle(1)));
    EXPECT_THROW(check_mesh(mesh), InvalidMesh);
  }
  {
    TriMesh mesh = to_mesh(tetrahedron());
    mesh.set_vertex_handle(OpenMesh::HalfedgeHandle(0), OpenMesh::VertexHandle(3));
    EXPECT_THROW(check_mesh(mesh), InvalidMesh);
  }
  {
    TriMesh mesh = to_mesh(some_surface(0));
    mesh.delete_face(OpenMesh::FaceHandle(7));
    EXPECT_THROW(check_mesh(mesh), InvalidMesh);
  }
}

TEST(TriangleMesh, TimeOfTheWayToTheMeshAndBackIsPrinted) {
  using Clock = std::chrono::steady_clock;
  const Triangles surface = ball(Eigen::Vector3d::Zero(), 1, 1.2 / 50);
  const auto start = Clock::now();
  const TriMesh mesh = to_mesh(surface);
  const auto middle = Clock::now();
  const Triangles back = to_triangles(mesh);
  const auto end = Clock::now();
  EXPECT_EQ(back.elements, surface.elements);
  using Milliseconds = std::chrono::duration<double, std::milli>;
  std::printf("%zu triangles: to_mesh %.1f ms, to_triangles %.1f ms\n", mesh.n_faces(),
              Milliseconds(middle - start).count(), Milliseconds(end - middle).count());
}

}  // namespace
}  // namespace surf::mesh
