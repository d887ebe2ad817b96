#include "libsurf/mesh/detail/close_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>

#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

using Pairs = std::set<std::pair<int, int>>;

Pairs found_by_the_grid(const std::vector<BoundingBall>& balls, double reach) {
  const RowGrid grid(balls, reach);
  Pairs pairs;
  for (int row = 0; row < grid.n_rows(); ++row)
    grid.for_each_pair(row, [&](int a, int b) {
      EXPECT_TRUE(pairs.insert(std::minmax(a, b)).second) << "twice: " << a << ", " << b;
    });
  return pairs;
}

Pairs found_one_by_one(const std::vector<BoundingBall>& balls) {
  Pairs pairs;
  for (int a = 0; a < int(balls.size()); ++a)
    for (int b = a + 1; b < int(balls.size()); ++b)
      if ((balls[a].center - balls[b].center).norm() <= balls[a].radius + balls[b].radius)
        pairs.insert({a, b});
  return pairs;
}

TEST(ClosePairs, AreThoseWhoseBallsMeetAndEachOnce) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 1), size(0, 0.2);
  std::vector<BoundingBall> balls(400);
  for (auto& ball : balls) ball = {{place(random), place(random), place(random)}, size(random)};
  const Pairs expected = found_one_by_one(balls);
  ASSERT_GT(expected.size(), 50u);
  EXPECT_EQ(found_by_the_grid(balls, 0.4), expected);
}

TEST(ClosePairs, OfPointsAreThoseInTheSamePlace) {
  const std::vector<BoundingBall> balls = {{{1, 2, 3}, 0}, {{1, 2, 4}, 0}, {{1, 2, 3}, 0}};
  EXPECT_EQ(found_by_the_grid(balls, 0), (Pairs{{0, 2}}));
}

TEST(ClosePairs, BoundingBallsHoldTheirTriangles) {
  const Triangles surface = some_surface(3);
  const auto balls = bounding_balls(surface.points, surface.elements);
  ASSERT_EQ(Eigen::Index(balls.size()), surface.elements.rows());
  for (Eigen::Index t = 0; t < surface.elements.rows(); ++t) {
    double farthest = 0;
    for (int i = 0; i < 3; ++i)
      farthest = std::max(
          farthest,
          (surface.points.row(surface.elements(t, i)).transpose() - balls[t].center).norm());
    EXPECT_DOUBLE_EQ(balls[t].radius, farthest);
  }
}

}  // namespace
}  // namespace surf::mesh
