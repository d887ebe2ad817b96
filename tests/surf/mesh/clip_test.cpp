#include "libsurf/mesh/clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"

namespace surf::mesh {
namespace {

/// Cells of these sides [mm], the outer corner of the first one at `corner`.
ImageBox<3> box_at(const std::array<int, 3>& size, const Eigen::Matrix3d& sides,
                   const Eigen::Vector3d& corner) {
  Eigen::Affine3d affine;
  affine.linear() = sides;
  affine.translation() = corner + sides * Eigen::Vector3d::Constant(0.5);
  affine.makeAffine();
  return {size, affine, affine.inverse()};
}

Eigen::Matrix3d rotated() {
  return Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
}

void expect_clipped(const Triangles& surface, const ImageBox<3>& box, double volume) {
  const Verification verification = verify(surface);
  EXPECT_TRUE(verification.passed()) << verification.message();
  EXPECT_NEAR(volume_mm3(surface), volume, 1e-9);
  for (const auto& point : surface.points.rowwise()) {
    const Vector<3> at = point.transpose();
    EXPECT_LT((box.clamped(at) - at).norm(), 1e-12);
  }
}

TEST(Clip, LeavesWhatLiesInTheBox) {
  const Triangles surface = ball({0, 0, 0}, 1, 0.4);
  const Triangles out =
      clipped(surface, box_at({3, 3, 3}, Eigen::Matrix3d::Identity(), {-1.5, -1.5, -1.5}));
  EXPECT_EQ(out.points, surface.points);
  EXPECT_EQ(out.elements, surface.elements);
}

TEST(Clip, TakesTheShareOfACube) {
  const Triangles surface = box({0, 0, 0}, {1, 1, 1}, 0.3);
  const auto cells = box_at({4, 4, 4}, Eigen::Vector3d(0.5, 0.5, 0.5).asDiagonal(), {0.7, -1, -1});
  expect_clipped(clipped(surface, cells), cells, 0.3);
  // A corner, cut by three faces.
  const auto corner = box_at({4, 4, 4}, Eigen::Matrix3d::Identity(), {0.7, 0.6, 0.5});
  expect_clipped(clipped(surface, corner), corner, 0.3 * 0.4 * 0.5);
}

// A ball's polyhedron has its centre as a centre of symmetry: a plane through it takes half.
TEST(Clip, HalvesABallInObliqueAndMirroredFrames) {
  const Eigen::Vector3d center(1, -2, 3);
  const Triangles surface = ball(center, 1, 0.35);
  const double half = volume_mm3(surface) / 2;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Matrix3d sides = rotated();
    sides.col(0) *= sign;
    const auto cells = box_at({3, 4, 4}, sides, center - sides * Eigen::Vector3d(0, 2, 2));
    expect_clipped(clipped(surface, cells), cells, half);
  }
}

TEST(Clip, LeavesTheOtherVerticesWhereTheyWereToTheBit) {
  const Eigen::Vector3d center(1, -2, 3);
  const Triangles surface = ball(center, 1, 0.35);
  const auto cells = box_at({3, 4, 4}, rotated(), center - rotated() * Eigen::Vector3d(0, 2, 2));
  const auto out = clipped(surface, cells);
  std::set<std::array<double, 3>> places;
  for (const auto& x : out.points.rowwise()) places.insert({x[0], x[1], x[2]});
  int n = 0;
  for (const auto& x : surface.points.rowwise()) {
    if ((cells.index(x.transpose()) < cells.first() + 0.01).any()) continue;
    ++n;
    EXPECT_TRUE(places.contains({x[0], x[1], x[2]}));
  }
  EXPECT_GT(n, 20);
}

TEST(Clip, PutsTheCutOnTheFace) {
  const auto cells = box_at({4, 4, 4}, rotated(), rotated() * Eigen::Vector3d(0, -2, -2));
  const Triangles out = clipped(ball({0, 0, 0}, 1, 0.35), cells);
  double on_face = 0;
  for (const auto& t : out.elements.rowwise()) {
    std::uint8_t common = 0xff;
    for (const int i : {t[0], t[1], t[2]}) common &= cells.faces(out.points.row(i).transpose());
    const Vector<3> a = out.points.row(t[0]), b = out.points.row(t[1]), c = out.points.row(t[2]);
    if (common != 0) {
      EXPECT_EQ(common, 1);
      const Vector<3> normal = (b - a).cross(c - a) / 2;
      EXPECT_NEAR(normal.dot(cells.normals().row(0)), normal.norm(), 1e-9);
      on_face += normal.norm();
    }
  }
  // Of the polyhedron, whose vertices lie on the sphere.
  EXPECT_GT(on_face, 0.9 * M_PI);
  EXPECT_LT(on_face, M_PI);
}

TEST(Clip, KeepsTheVolumeOfACavityOut) {
  const Triangles shell =
      joined({box({0, 0, 0}, {4, 4, 4}, 1), flipped(box({1, 1, 1}, {3, 3, 3}, 1))});
  const auto cells = box_at({5, 5, 5}, Eigen::Matrix3d::Identity(), {2, -0.5, -0.5});
  expect_clipped(clipped(shell, cells), cells, 2 * 16 - 4);
}

double least_height(const Triangles& surface) {
  double out = 1e300;
  for (const auto& t : surface.elements.rowwise()) {
    const Vector<3> a = surface.points.row(t[0]), b = surface.points.row(t[1]),
                    c = surface.points.row(t[2]);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    out = std::min(out, (b - a).cross(c - a).norm() / longest);
  }
  return out;
}

// A cut beside a vertex leaves triangles as thin as their distance: below rounding they have no
// measure, and nothing can be computed on them.
TEST(Clip, LeavesNoSliversWhereVerticesAreAllButOnAFace) {
  std::mt19937 random(3);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int run = 0; run < 60; ++run) {
    Triangles surface = ball({0.1, -0.2, 0.3}, 4, 1.2);
    const double face = uniform(-2, 3), other = uniform(-2, 2);
    const auto cells = box_at({9, 9, 9}, Eigen::Matrix3d::Identity(), {face, other, -3.5});
    for (Eigen::Index i = 0; i < surface.points.rows(); ++i) {
      const double way = std::pow(10, uniform(-16, -2)) * (run % 2 == 0 ? 1 : -1);
      if (std::abs(surface.points(i, 0) - face) < 0.3) surface.points(i, 0) = face + way;
      if (run % 3 == 0 && std::abs(surface.points(i, 1) - other) < 0.3)
        surface.points(i, 1) = other + way;
    }
    if (!verify(surface).passed()) continue;
    const Triangles out = clipped(surface, cells);
    const Verification verification = verify(out);
    EXPECT_TRUE(verification.passed()) << run << ": " << verification.message();
    EXPECT_GT(least_height(out), 1e-5) << run;
  }
}

// And faces without any area, where a fine surface winds about a face of the box.
TEST(Clip, LeavesNoTrianglesWithoutAreaOfWhatWindsAboutAFace) {
  std::mt19937 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int n_tried = 0;
  for (int run = 0; run < 40; ++run) {
    Triangles surface = ball({0.1, -0.2, 0.3}, 4, 0.4);
    const double face = uniform(-2, 3);
    const auto cells = box_at({9, 9, 9}, rotated(), rotated() * Eigen::Vector3d(face, -4.5, -4.5));
    for (Eigen::Index i = 0; i < surface.points.rows(); ++i) {
      double& x = surface.points(i, 0);
      if (std::abs(x - face) < 0.15)
        x = face + (uniform(-1, 1) < 0 ? -1 : 1) * std::pow(10, uniform(-4.5, -2));
    }
    surface.points = surface.points * rotated().transpose();
    if (!verify(surface).passed()) continue;
    ++n_tried;
    const Verification verification = verify(clipped(surface, cells));
    EXPECT_TRUE(verification.passed()) << run << ": " << verification.message();
  }
  EXPECT_GT(n_tried, 20);
}

TEST(Clip, LeavesWhatHasBeenClippedToTheBit) {
  const Eigen::Vector3d center(1, -2, 3);
  const Triangles surface = ball(center, 1, 0.35);
  for (const Eigen::Vector3d& sides :
       {Eigen::Vector3d(0.5, 0.5, 0.5), Eigen::Vector3d(-0.7, 0.3, 0.9)}) {
    const Eigen::Matrix3d frame = rotated() * sides.asDiagonal();
    const auto cells = box_at({4, 4, 4}, frame, center - frame * Eigen::Vector3d(1.3, 2.2, 2.6));
    const Triangles once = clipped(surface, cells), twice = clipped(once, cells);
    EXPECT_LT(volume_mm3(once), 0.95 * volume_mm3(surface));
    ASSERT_EQ(twice.points.rows(), once.points.rows());
    ASSERT_EQ(twice.elements.rows(), once.elements.rows());
    EXPECT_EQ(twice.points, once.points);
    EXPECT_EQ(twice.elements, once.elements);
  }
}

TEST(Clip, RefusesWhatHasNothingInTheBox) {
  const auto cells = box_at({3, 3, 3}, Eigen::Matrix3d::Identity(), {5, 5, 5});
  EXPECT_THROW(clipped(ball({0, 0, 0}, 1, 0.4), cells), InvalidMesh);
}

// Not by when an intersection is found, which differs from run to run.
TEST(Clip, NumbersVerticesByTheirPlacesAndFacesByTheirVertices) {
  const auto cells = box_at({4, 4, 4}, Eigen::Vector3d(0.5, 0.5, 0.5).asDiagonal(), {-1, -1, 0.1});
  const Triangles out = clipped(ball({0, 0, 0}, 0.9, 0.3), cells);
  for (Eigen::Index i = 1; i < out.points.rows(); ++i)
    EXPECT_LE(out.points(i - 1, 0), out.points(i, 0) + 1e-12) << i;
  std::vector<std::array<int, 3>> faces;
  for (const auto& t : out.elements.rowwise()) {
    std::array<int, 3> corners = {t[0], t[1], t[2]};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    faces.push_back(corners);
  }
  EXPECT_TRUE(std::is_sorted(faces.begin(), faces.end()));
}

}  // namespace
}  // namespace surf::mesh
