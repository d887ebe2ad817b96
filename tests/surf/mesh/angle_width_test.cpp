#include "libsurf/mesh/angle_width.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// Stretches a surface along x and moves its vertices at random, so that wide angles appear.
TriMesh surface_with_wide_angles(int kind, std::mt19937& random) {
  TriMesh mesh = to_mesh(some_surface(kind));
  std::uniform_real_distribution<double> shift(-0.04, 0.04);
  for (const auto vertex : mesh.vertices()) {
    Eigen::Vector3d x = mesh.point(vertex);
    x += Eigen::Vector3d(shift(random), shift(random), shift(random));
    x[0] *= 2;
    mesh.set_point(vertex, x);
  }
  return mesh;
}

int n_wider_than(const TriMesh& mesh, double degrees) {
  const Points<3> angles = angles_deg(mesh);
  return static_cast<int>((angles.rowwise().maxCoeff().array() > degrees).count());
}

TEST(AngleWidth, LeavesNoWideAngleOrSaysThatTheLimitWasReached) {
  std::mt19937 random(1);
  for (int kind = 0; kind < 4; ++kind)
    for (const bool is_refined_before : {false, true}) {
      TriMesh mesh = surface_with_wide_angles(kind, random);
      const double volume = enclosed_volume(mesh);
      if (is_refined_before) refine_long_edges(mesh, 0.3);
      ASSERT_GT(n_wider_than(mesh, 120), 0);
      const AngleWidthOptions options;
      const AngleWidthReport report = control_angle_width(mesh, options);
      check_mesh(mesh);
      EXPECT_EQ(n_wider_than(mesh, 120), report.n_wide);
      EXPECT_TRUE(report.n_wide == 0 || report.n_rounds == options.max_rounds);
      EXPECT_GT(report.n_new_vertices, 0);
      EXPECT_NEAR(enclosed_volume(mesh) / volume, 1, 1e-12);
    }
}

TEST(AngleWidth, LeavesFewWideAngles) {
  std::mt19937 random(2);
  for (int kind = 0; kind < 4; ++kind) {
    TriMesh mesh = surface_with_wide_angles(kind, random);
    const int n_before = n_wider_than(mesh, 120);
    EXPECT_LT(5 * control_angle_width(mesh).n_wide, n_before);
  }
}

TEST(AngleWidth, LeavesASurfaceWithoutWideAnglesAlone) {
  TriMesh mesh = to_mesh(some_surface(0));
  const Points<3> before = points(mesh);
  const AngleWidthReport report = control_angle_width(mesh);
  EXPECT_EQ(report.n_rounds, 0);
  EXPECT_EQ(points(mesh), before);
}

TEST(AngleWidth, StopsAtTheLimit) {
  std::mt19937 random(3);
  TriMesh mesh = surface_with_wide_angles(0, random);
  // No triangulation has all angles below 61 degrees here.
  const AngleWidthReport report = control_angle_width(mesh, {.max_angle_deg = 61, .max_rounds = 2});
  EXPECT_EQ(report.n_rounds, 2);
  EXPECT_GT(report.n_wide, 0);
  check_mesh(mesh);
}

}  // namespace
}  // namespace surf::mesh
