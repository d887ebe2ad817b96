#include "libsurf/flow/detail/stepper.h"

#include <gtest/gtest.h>

#include "libsurf/flow/step_control.h"
#include "libsurf/mesh/primitives.h"

namespace surf::flow {
namespace {

constexpr double kMost = 0.5;  // mm

/// A ball all of which wants to go out by 0.1 mm, but for a cap that wants to go out by 5.
struct BallWithAFastCap {
  BallWithAFastCap() {
    const Triangles ball = mesh::ball(Vector<3>::Zero(), 10, 1);
    shape = std::make_unique<fem::Geometry<3>>(ball.points, ball.elements);
    velocity = ball.points.rowwise().normalized();
    for (Eigen::Index i = 0; i < velocity.rows(); ++i) {
      const double depth = (ball.points(i, 2) - 6) / 4;  // of the cap, at most 1
      const double speed = depth > 0 ? 0.1 + 4.9 * depth * depth : 0.1;
      velocity.row(i) *= speed;
    }
  }
  std::unique_ptr<fem::Geometry<3>> shape;
  Points<3> velocity;
};

TEST(BoundedDisplacement, ShortensEachVertexForItself) {
  const BallWithAFastCap ball;
  const Points<3> all = bounded_displacement<3>(ball.velocity, 0.5, kMost, StepBound::kShape);
  EXPECT_EQ(all, 0.5 * ball.velocity);
  const Points<3> each = bounded_displacement<3>(ball.velocity, 0.5, kMost, StepBound::kVertex);
  int n_bounded = 0;
  for (Eigen::Index i = 0; i < each.rows(); ++i) {
    if (all.row(i).norm() <= kMost) {
      EXPECT_EQ(each.row(i), all.row(i));
      continue;
    }
    ++n_bounded;
    EXPECT_NEAR(each.row(i).norm(), kMost, 1e-12);
    EXPECT_NEAR(each.row(i).dot(all.row(i)), kMost * all.row(i).norm(), 1e-12);
  }
  EXPECT_GT(n_bounded, 10);
}

TEST(LargestStep, FastVerticesHoldUpNoOthers) {
  const BallWithAFastCap ball;
  StepOptions options;
  const double of_shape = largest_step<3>(*ball.shape, ball.velocity, kMost, options);
  EXPECT_NEAR(of_shape, 0.1, 0.01);  // 0.5 mm by 5
  options.bound = StepBound::kVertex;
  const double of_vertices = largest_step<3>(*ball.shape, ball.velocity, kMost, options);
  EXPECT_GT(of_vertices, 4 * of_shape);
  EXPECT_LE(of_vertices, 1);  // of an inexact Newton method
  // Alg. 3's bound holds for what is moved.
  const Points<3> moved =
      bounded_displacement<3>(ball.velocity, of_vertices, kMost, StepBound::kVertex);
  EXPECT_LE(max_velocity_gradient<3>(*ball.shape, moved, options.exempt_share),
            options.epsilon_tau);
}

TEST(LargestStep, IsNeverLessThanThatOfTheShape) {
  const BallWithAFastCap ball;
  StepOptions options;
  options.epsilon_tau = 0.01;  // of steep gradients
  const double of_shape = largest_step<3>(*ball.shape, ball.velocity, kMost, options);
  options.bound = StepBound::kVertex;
  EXPECT_GE(largest_step<3>(*ball.shape, ball.velocity, kMost, options), of_shape);
  EXPECT_EQ(largest_step<3>(*ball.shape, Points<3>::Zero(ball.velocity.rows(), 3), kMost, options),
            0);
}

}  // namespace
}  // namespace surf::flow
