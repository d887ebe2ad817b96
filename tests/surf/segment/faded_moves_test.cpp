#include "libsurf/segment/detail/faded_moves.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/mesh/primitives.h"

namespace surf::segment {
namespace {

TEST(FadedMoves, AreAsTheyAreWhereAllAreKnownAndNoneWhereNoneIs) {
  const Triangles ball = mesh::ball(Vector<3>::Zero(), 10, 1);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  const Eigen::VectorXd moves = Eigen::VectorXd::LinSpaced(ball.points.rows(), -1, 1);
  const auto n = std::size_t(moves.size());
  EXPECT_EQ(faded_moves<3>(geometry, moves, std::vector<char>(n, 1), 2), moves);
  EXPECT_TRUE(faded_moves<3>(geometry, moves, std::vector<char>(n, 0), 2).isZero());
}

// Half of a ball has moved by one: beyond the equator the moves decay about as exp(-s / reach).
TEST(FadedMoves, DecayWithTheDistanceFromWhatIsKnown) {
  const double radius = 15, reach = 3;
  const Triangles ball = mesh::ball(Vector<3>::Zero(), radius, 0.5);
  const fem::Geometry<3> geometry(ball.points, ball.elements);
  std::vector<char> is_known;
  for (const auto x : ball.points.rowwise()) is_known.push_back(x[2] > 0);
  const Eigen::VectorXd u =
      faded_moves<3>(geometry, Eigen::VectorXd::Ones(ball.points.rows()), is_known, reach);
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const double s = radius * std::asin(std::max(0.0, -ball.points(i, 2) / radius));
    if (s > 0 && s < 3 * reach) {
      EXPECT_NEAR(u[i], std::exp(-s / reach), 0.12) << s;
    }
  }
}

}  // namespace
}  // namespace surf::segment
