#include "libsurf/mesh/detail/star_patch.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

struct Star : ::testing::Test {
  TriMesh mesh = to_mesh(ball({0, 0, 0}, 1, 0.4));
  ImproveOptions options = {.min_length = 0.01, .max_length = 2, .tolerance_mm = 0.05};
  Mending work{mesh, options};
  StarPatch patch{work};
  VertexHandle vertex{20};
};

TEST_F(Star, HoldsTheTrianglesRoundAVertex) {
  patch.collect(vertex);
  EXPECT_EQ(patch.before.size(), mesh.valence(vertex));
  EXPECT_EQ(patch.kept.size(), mesh.valence(vertex));
  for (std::size_t k = 0; k < patch.before.size(); ++k) {
    EXPECT_EQ(patch.before[k][0], mesh.point(vertex));
    EXPECT_EQ(patch.weight[k], 1);
  }
  EXPECT_EQ(patch.witnesses.size(), 3 * mesh.valence(vertex) + 1);  // corners and midpoints, once
}

TEST_F(Star, OfTwoVerticesCountsSharedTrianglesOnce) {
  const VertexHandle other = *mesh.cvv_iter(vertex);
  patch.collect(vertex, other);
  const std::size_t n = mesh.valence(vertex) + mesh.valence(other);
  EXPECT_EQ(patch.before.size(), n);
  EXPECT_EQ(std::accumulate(patch.weight.begin(), patch.weight.end(), 0.0), n - 2);
  EXPECT_EQ(patch.kept.size(), n - 4);           // two triangles at the edge go
  EXPECT_EQ(patch.witnesses.size(), 3 * n - 7);  // n - 2 corners and 2 n - 5 midpoints
}

// The volume is linear in the place of one vertex.
TEST_F(Star, RimNormalIsSixTimesTheGradientOfTheVolume) {
  patch.collect(vertex);
  const Vector3d by(0.03, -0.01, 0.02), place = mesh.point(vertex);
  const double before = enclosed_volume(mesh);
  const Vector3d normal = patch.rim_normal(place);
  EXPECT_LT((patch.rim_normal(Vector3d::Zero()) - normal).norm(), 1e-14);
  mesh.set_point(vertex, place + by);
  EXPECT_NEAR(enclosed_volume(mesh) - before, normal.dot(by) / 6, 1e-14);
}

TEST_F(Star, TakesTheBestAngleAmongAllowedPlaces) {
  patch.collect(vertex);
  const Vector3d here = mesh.point(vertex);
  const Vector3d aside = (patch.kept[0][1] - here) / 2;
  const std::vector<Vector3d> places = {here + aside, here, here + aside / 2};
  const auto best = patch.best_place(places, 1, 10);
  ASSERT_TRUE(best);
  EXPECT_EQ(*best, here);
  // Without it the next best; beyond the tolerance none; with spokes too long none.
  EXPECT_EQ(patch.best_place({places[0], places[2]}, 1, 10), places[2]);
  EXPECT_FALSE(patch.best_place({here * 1.2, here * 0.8}, 1, 10));
  EXPECT_FALSE(patch.best_place(places, 1, 0.1));
}

TEST_F(Star, TakesNoPlaceWithASharperAngleThanTheBound) {
  patch.collect(vertex);
  const double cosine = sharpest(patch.before);
  EXPECT_TRUE(patch.best_place({mesh.point(vertex)}, cosine + 1e-9, 10));
  EXPECT_FALSE(patch.best_place({mesh.point(vertex)}, cosine - 1e-9, 10));
}

TEST_F(Star, TurnsNoTriangleOver) {
  options.tolerance_mm = 10;
  patch.collect(vertex);
  const Vector3d here = mesh.point(vertex);
  const Vector3d beyond = here + 2.5 * ((patch.kept[0][1] + patch.kept[0][2]) / 2 - here);
  EXPECT_FALSE(patch.best_place({beyond}, 1, 10));
}

TEST_F(Star, AppliedMovesTheVertex) {
  patch.collect(vertex);
  const Vector3d place = mesh.point(vertex) * 0.99;
  const StarPlan plan = patch.plan(place);
  EXPECT_NE(mesh.point(vertex), place);
  EXPECT_EQ(plan.faces, patch.faces);
  ASSERT_EQ(plan.keepers.size(), plan.witnesses.size());
  const VertexHandle neighbour = *mesh.cvv_iter(vertex);
  EXPECT_FALSE(work.has_changed_round(neighbour, work.n_changes()));
  const int n_changes = work.n_changes();
  apply(plan, vertex, work);
  EXPECT_EQ(mesh.point(vertex), place);
  EXPECT_GT(work.last_change_at(vertex), n_changes);
  EXPECT_TRUE(work.has_changed_round(neighbour, n_changes));
  // What the faces keep is the surface at the start, none of it twice or lost.
  std::vector<Vector3d> handed;
  for (const FaceHandle face : plan.faces) work.add_witnesses(face, handed);
  EXPECT_EQ(handed.size(), patch.witnesses.size());
}

}  // namespace
}  // namespace surf::mesh
