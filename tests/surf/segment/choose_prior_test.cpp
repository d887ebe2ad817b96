#include "libsurf/segment/detail/choose_prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "libsurf/mesh/primitives.h"

namespace surf::segment {
namespace {

/// Of a ball with elements of 1 mm whose surface waves along z, seen in noise of `deviation` at
/// each vertex and in each half.
double length_of(double radius, double wave_length, double amplitude, double deviation) {
  const Triangles ball = mesh::ball(Vector<3>::Zero(), radius, 1);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const Points<3> normals = geometry.nodal_normals().rowwise().normalized();
  const Eigen::Index n = ball.points.rows();
  const double information = 1 / (deviation * deviation);
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  std::array<Observations, 2> halves;
  for (Observations& half : halves) {
    half.P.resize(n, n);
    half.P.setIdentity();
    half.P *= information;
    half.b.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double move =
          amplitude * std::sin(2 * std::numbers::pi * ball.points(i, 2) / wave_length);
      half.b[i] = information * (move + deviation * normal(generator));
    }
  }
  return choose_prior<3>(geometry, BendingMatrices(geometry), normals, halves,
                         Eigen::VectorXd::Zero(n), 1, 5)
      .length_mm;
}

// 2,000 vertices are compared as they are, of 9,000 four patches.
TEST(ChoosePrior, TakesAShortLengthForWavesAndALongOneForNoise) {
  for (const double radius : {12.0, 25.0}) {
    EXPECT_LE(length_of(radius, 8, 0.5, 0.1), 8) << radius;
    EXPECT_GE(length_of(radius, 8, 0, 0.1), 16) << radius;
  }
}

TEST(ChoosePrior, EndsWhenItIsStopped) {
  const Triangles ball = mesh::ball(Vector<3>::Zero(), 12, 2);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const Eigen::Index n = ball.points.rows();
  Observations none{Eigen::SparseMatrix<double>(n, n), Eigen::VectorXd::Zero(n)};
  none.P.setIdentity();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_GT(choose_prior<3>(geometry, BendingMatrices(geometry), geometry.nodal_normals(),
                            {none, none}, Eigen::VectorXd::Zero(n), 1, 5, stop.get_token())
                .length_mm,
            0);
}

}  // namespace
}  // namespace surf::segment
