#include "libsurf/mesh/smoothing.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// A surface whose vertices have moved along it at random.
TriMesh rough_surface(int kind, std::mt19937& random) {
  TriMesh mesh = to_mesh(some_surface(kind));
  move(mesh, WavyField(random, 0.1));
  std::uniform_real_distribution<double> shift(-0.03, 0.03);
  for (const auto vertex : mesh.vertices())
    mesh.set_point(
        vertex, mesh.point(vertex) + Eigen::Vector3d(shift(random), shift(random), shift(random)));
  return mesh;
}

TEST(Smoothing, KeepsTheVolumeToRounding) {
  std::mt19937 random(1);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = rough_surface(kind, random);
    const Points<3> before = points(mesh);
    const double volume = enclosed_volume(mesh);
    const SmoothingReport report = smooth(mesh, {.n_sweeps = 10});
    check_mesh(mesh);
    constexpr double kTolerance = 1e-12;  // a hundred vertices, ten sweeps, eps each
    EXPECT_NEAR(enclosed_volume(mesh) / volume, 1, kTolerance);
    EXPECT_GT(report.n_moved, 5 * static_cast<int>(mesh.n_vertices()));
    EXPECT_GT((points(mesh) - before).norm(), 0.1);
  }
}

TEST(Smoothing, KeepsTheVolumeFarFromTheOrigin) {
  TriMesh mesh = to_mesh(some_surface(0));
  std::mt19937 random(2);
  move(mesh, WavyField(random, 0.2));
  const double volume = enclosed_volume(mesh);
  for (const auto vertex : mesh.vertices())
    mesh.set_point(vertex, mesh.point(vertex) + Eigen::Vector3d(1000, -2000, 500));
  smooth(mesh, {.n_sweeps = 5});
  EXPECT_NEAR(enclosed_volume(mesh) / volume, 1, 1e-11);  // points are rounded to 2000 * eps
}

TEST(Smoothing, MakesEdgesEven) {
  TriMesh mesh = to_mesh(ball(Eigen::Vector3d::Zero(), 1, 0.15));
  // A tangential flow towards the poles.
  for (const auto vertex : mesh.vertices()) {
    Eigen::Vector3d x = mesh.point(vertex);
    x[2] *= 1.8;
    mesh.set_point(vertex, x.normalized());
  }
  const double before = min_angle_deg(mesh);
  smooth(mesh, {.n_sweeps = 50});
  EXPECT_LT(before, 34);
  EXPECT_GT(min_angle_deg(mesh), before + 5);
}

TEST(Smoothing, NeverLowersTheSmallestAngleBelowTheBound) {
  std::mt19937 random(4);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = rough_surface(kind, random);
    for (int sweep = 0; sweep < 10; ++sweep) {
      const double before = min_angle_deg(mesh);
      smooth(mesh, {.min_angle_deg = 15});
      EXPECT_GE(min_angle_deg(mesh), std::min(before, 15.0) - 1e-9);
    }
  }
}

TEST(Smoothing, LeavesAFoldedStarAlone) {
  // The star of vertex 4 is a flat strip there and back: its area normals cancel.
  Triangles surface{Points<3>(6, 3), Elements<3>(8, 3)};
  surface.points << 1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
  surface.elements << 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5;
  surface.points.row(1) << 1, 0, 0.5;
  surface.points.row(3) << -1, 0, 0.5;
  TriMesh mesh = to_mesh(surface);
  const Eigen::Vector3d before = mesh.point(OpenMesh::VertexHandle(4));
  smooth(mesh);
  EXPECT_TRUE(points(mesh).allFinite());
  EXPECT_EQ(mesh.point(OpenMesh::VertexHandle(4)), before);
}

}  // namespace
}  // namespace surf::mesh
