#include "libsurf/mesh/primitives.h"

#include <gtest/gtest.h>

#include <numbers>

#include "libsurf/base/error.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

TEST(Primitives, BallHasItsVerticesOnTheSphereAndTheWantedEdges) {
  const Vector3d center(10, -20, 30);
  for (const double edge_length : {5.0, 1.0, 0.3}) {
    const Triangles surface = ball(center, 2, edge_length);
    const TriMesh mesh = to_mesh(surface);
    check_mesh(mesh);
    const Eigen::VectorXd radii = (surface.points.rowwise() - center.transpose()).rowwise().norm();
    EXPECT_NEAR(radii.minCoeff(), 2, 1e-14 * 30);
    EXPECT_NEAR(radii.maxCoeff(), 2, 1e-14 * 30);
    double sum = 0;
    for (const auto edge : mesh.edges()) sum += mesh.calc_edge_length(edge);
    const double mean = sum / static_cast<double>(mesh.n_edges());
    EXPECT_LE(mean, edge_length);
    EXPECT_GE(mean, mesh.n_faces() > 20 ? 0.6 * edge_length : 0);
    EXPECT_GE(min_angle_deg(mesh), 50);
  }
}

// The inscribed polyhedron's volume is that of the ball less O(h^2).
TEST(Primitives, VolumeOfTheBallConvergesWithOrderTwo) {
  const double exact = 4 * std::numbers::pi / 3;
  const double coarse = exact - enclosed_volume(to_mesh(ball(Vector3d::Zero(), 1, 1.21 / 12)));
  const double fine = exact - enclosed_volume(to_mesh(ball(Vector3d::Zero(), 1, 1.21 / 24)));
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.02);
}

TEST(Primitives, EllipsoidIsTheImageOfTheSphereAlsoForMirroredAxes) {
  Eigen::Matrix3d axes;
  axes << 3, 0.2, 0, 0, 1, 0.1, 0.3, 0, -0.5;  // determinant < 0
  const Vector3d center(1, 2, 3);
  const Triangles surface = ellipsoid(center, axes, 0.3);
  const TriMesh mesh = to_mesh(surface);
  check_mesh(mesh);
  const double exact = 4 * std::numbers::pi / 3 * std::abs(axes.determinant());
  EXPECT_NEAR(enclosed_volume(mesh) / exact, 1, 0.02);
  const Points<3> unit =
      (surface.points.rowwise() - center.transpose()) * axes.transpose().inverse();
  EXPECT_LT((unit.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-14 * 30);
}

TEST(Primitives, BoxHasExactVolumeAreaAndSharpEdges) {
  const Vector3d lower(-1, 2, 5), upper(0, 4, 8);
  const Triangles surface = box(lower, upper, 0.25);
  const TriMesh mesh = to_mesh(surface);
  check_mesh(mesh);
  EXPECT_EQ(mesh.n_faces(), 4u * (4 * 8 + 8 * 12 + 12 * 4));
  EXPECT_NEAR(enclosed_volume(mesh), 6, 6e-14);
  EXPECT_NEAR(surface_area(mesh), 22, 22e-14);
  EXPECT_NEAR(min_angle_deg(mesh), 45, 1e-9);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d point((corner & 1 ? upper : lower)[0], (corner & 2 ? upper : lower)[1],
                         (corner & 4 ? upper : lower)[2]);
    EXPECT_EQ((surface.points.rowwise() - point.transpose()).rowwise().norm().minCoeff(), 0);
  }
}

TEST(Primitives, NonsenseIsAUsageError) {
  EXPECT_THROW(ball(Vector3d::Zero(), 0, 1), UsageError);
  EXPECT_THROW(ball(Vector3d::Zero(), 1, -1), UsageError);
  EXPECT_THROW(ball(Vector3d::Zero(), 1, 1e-9), UsageError);
  EXPECT_THROW(ellipsoid(Vector3d::Zero(), Eigen::Matrix3d::Zero(), 1), UsageError);
  EXPECT_THROW(box(Vector3d::Zero(), Vector3d(1, 1, 0), 0.1), UsageError);
  EXPECT_THROW(box(Vector3d::Zero(), Vector3d(1, 1e12, 1), 0.1), UsageError);
  EXPECT_EQ(box(Vector3d::Zero(), Vector3d(200, 0.1, 0.1), 0.05).elements.rows(),
            4 * (2 * 4000 * 2 + 2 * 2));
}

}  // namespace
}  // namespace surf::mesh
