#include "libsurf/mesh/rasterize.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <numeric>

#include "libsurf/mesh/measure.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::mesh {
namespace {

using namespace surf::test;
using Labels = std::vector<std::uint8_t>;

std::size_t count(const Labels& labels) {
  return std::accumulate(labels.begin(), labels.end(), std::size_t(0));
}

/// Oblique, sheared, anisotropic; mirrored if asked.
Eigen::Affine3d crooked_affine(bool is_mirrored) {
  Eigen::Affine3d affine = Eigen::Translation3d(-7.3, -6.1, -8.9) *
                           Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()) *
                           Eigen::Scaling(0.5, 0.7, 0.9);
  affine.linear()(0, 2) += 0.2;
  if (is_mirrored) affine.linear().col(1) *= -1;
  return affine;
}

TEST(Rasterize, AgreesWithCgalAtEveryGridPoint) {
  const Triangles surface = torus(4, 1.5, 50, 25);
  CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3> mesh;
  using Vertex = decltype(mesh)::Vertex_index;
  for (const auto p : surface.points.rowwise()) mesh.add_vertex({p[0], p[1], p[2]});
  for (const auto e : surface.elements.rowwise())
    mesh.add_face(Vertex(e[0]), Vertex(e[1]), Vertex(e[2]));
  const CGAL::Side_of_triangle_mesh<decltype(mesh),
                                    CGAL::Exact_predicates_inexact_constructions_kernel>
      side(mesh);
  for (const bool is_mirrored : {false, true}) {
    Eigen::Affine3d affine = crooked_affine(is_mirrored);
    const std::array<int, 3> size{30, 24, 20};
    affine.translation() -= affine * Vector<3>(15, 12, 10);  // the centre of the grid at 0
    const Labels found = rasterize(surface, size, affine);
    EXPECT_GT(count(found), 500u);
    std::size_t at = 0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i, ++at) {
          const Vector<3> p = affine * Vector<3>(i, j, k);
          ASSERT_EQ(found[at] != 0, side({p[0], p[1], p[2]}) == CGAL::ON_BOUNDED_SIDE)
              << i << ' ' << j << ' ' << k;
        }
  }
}

TEST(Rasterize, BallOfTheSameVolume) {
  const Triangles surface = sphere({50.2, 49.7, 50.1}, 40, 6);
  const Labels found = rasterize(surface, {100, 100, 100}, Eigen::Affine3d::Identity());
  constexpr double kLattice = 5e-4;  // scatter of lattice points in a ball of 40 voxels
  EXPECT_NEAR(double(count(found)) / volume_mm3(surface), 1, kLattice);
  std::size_t at = 0;
  for (int k = 0; k < 100; ++k)
    for (int j = 0; j < 100; ++j)
      for (int i = 0; i < 100; ++i, ++at) {
        const double r = (Vector<3>(i, j, k) - Vector<3>(50.2, 49.7, 50.1)).norm();
        constexpr double kInscribed = 0.03;  // how deep triangles cut into the sphere
        if (r < 40 - kInscribed) ASSERT_EQ(found[at], 1);
        if (r > 40) ASSERT_EQ(found[at], 0);
      }
}

// Every ray runs along edges, through vertices or within faces.
TEST(Rasterize, GridPointsOnTheSurfaceAreTakenOnOneSideOnly) {
  const Triangles box = moved(cube(), Eigen::Affine3d(Eigen::Scaling(4.0)));
  const Labels found = rasterize(moved(box, {2, 2, 2}), {10, 10, 10}, Eigen::Affine3d::Identity());
  EXPECT_EQ(count(found), 64u);
  const Labels octahedron =
      rasterize(sphere({5, 5, 5}, 4, 0), {11, 11, 11}, Eigen::Affine3d::Identity());
  // Half-open octahedra tile space in translation only with their volume, 4^3 * 4 / 3 = 85.3.
  EXPECT_NEAR(double(count(octahedron)), 85.3, 4);
  for (int k = 0; k < 11; ++k)
    for (int j = 0; j < 11; ++j) EXPECT_EQ(octahedron[(k * 11 + j) * 11 + 10], 0) << "leaks";
}

TEST(Rasterize, FillsEachPointOnceWhereSurfacesMeet) {
  const Triangles left = moved(cube(), Eigen::Affine3d(Eigen::Scaling(4.0)));
  for (const Vector<3>& step : {Vector<3>(4, 0, 0), Vector<3>(0, 4, 0), Vector<3>(0, 0, 4)}) {
    const Labels a = rasterize(left, {9, 9, 9}, Eigen::Affine3d::Identity());
    const Labels b = rasterize(moved(left, step), {9, 9, 9}, Eigen::Affine3d::Identity());
    for (std::size_t at = 0; at < a.size(); ++at) EXPECT_LE(a[at] + b[at], 1);
    EXPECT_EQ(count(a) + count(b), 128u);
  }
}

TEST(Rasterize, CavitiesAreOutsideAndOverlapsInside) {
  const auto n = [](const Triangles& surface) {
    return count(rasterize(surface, {40, 40, 40}, Eigen::Affine3d::Identity()));
  };
  const Triangles big = sphere({20, 20, 20}, 15, 4), small = sphere({20.5, 20, 20}, 7, 4),
                  aside = sphere({30, 20, 20}, 7, 4);
  EXPECT_EQ(n(joined(big, flipped(small))), n(big) - n(small));
  EXPECT_EQ(n(joined(big, small)), n(big));
  EXPECT_GT(n(joined(big, aside)), n(big));
  EXPECT_EQ(n(flipped(big)), n(big));
}

TEST(Rasterize, ASurfaceThatReachesOutOfTheGridIsCut) {
  const Triangles surface = sphere({0, 0, 0}, 6, 4);
  const Eigen::Affine3d whole(Eigen::Translation3d(-10, -10, -10));
  const Labels all = rasterize(surface, {21, 21, 21}, whole);
  const Labels part = rasterize(surface, {8, 21, 9}, whole * Eigen::Translation3d(7, 0, 8));
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 21; ++j)
      for (int i = 0; i < 8; ++i)
        ASSERT_EQ(part[(k * 21 + j) * 8 + i], all[((k + 8) * 21 + j) * 21 + i + 7]);
  EXPECT_EQ(count(rasterize(surface, {5, 5, 5}, Eigen::Affine3d(Eigen::Translation3d(20, 0, 0)))),
            0u);
  EXPECT_EQ(count(rasterize({}, {5, 5, 5}, whole)), 0u);
}

}  // namespace
}  // namespace surf::mesh
