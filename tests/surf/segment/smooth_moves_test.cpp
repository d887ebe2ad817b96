#include "libsurf/segment/detail/smooth_moves.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/surf/mesh/check_shapes.h"

namespace surf::segment {
namespace {

constexpr double kLength = 8;

/// A ball of radius 10 with the ring round vertex 0 drawn towards it, to `share` of its distance.
Triangles ball_with_small_elements(double share) {
  Triangles out = test::sphere(Eigen::Vector3d::Zero(), 10, 3);
  const Eigen::RowVector3d middle = out.points.row(0);
  std::set<int> ring;
  for (const auto& t : out.elements.rowwise())
    if ((t.array() == 0).any()) ring.insert(t.begin(), t.end());
  for (const int i : ring) out.points.row(i) = middle + share * (out.points.row(i) - middle);
  return out;
}

struct Prior {
  explicit Prior(const Triangles& shape)
      : geometry(shape.points, shape.elements),
        bending(geometry),
        moves(bending, geometry, geometry.directions().rowwise().normalized(), kLength) {}

  Posterior after(const Observations& data) const {
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(geometry.n_vertices());
    return {bending.cholesky(), moves.precision(1, ones), data, moves.smoothing()};
  }
  Observations nothing() const {
    const auto n = Eigen::Index(geometry.n_vertices());
    Observations out{geometry.topology().pattern(), Eigen::VectorXd::Zero(n)};
    out.P.coeffs().setZero();
    return out;
  }

  fem::Geometry<3> geometry;
  BendingMatrices bending;
  SmoothMoves<3> moves;
};

// Of a shape that no cell tells anything of the prior alone is left: its mean.
TEST(SmoothMoves, StayWhereNothingIsKnown) {
  const Prior prior(ball_with_small_elements(1));
  const Posterior posterior = prior.after(prior.nothing());
  EXPECT_LT((posterior.mean() - prior.moves.smoothing()).norm(),
            1e-3 * prior.moves.smoothing().norm() + 1e-9);
}

// Elements that are much smaller than the others make rounding larger than the prior's least
// information.
TEST(SmoothMoves, BearElementsThatAreMuchSmaller) {
  for (const double share : {1e-2, 1e-4, 1e-6}) {
    const Prior prior(ball_with_small_elements(share));
    const Posterior posterior = prior.after(prior.nothing());
    EXPECT_TRUE(posterior.mean().allFinite()) << share;
    EXPECT_GT(posterior.variances().minCoeff(), 0) << share;
  }
}

// As observations of a part of a shape do, where elements between its vertices are left out.
TEST(SmoothMoves, HeedObservationsThatCoupleVerticesWithoutAnElement) {
  const Triangles shape = ball_with_small_elements(1);
  const fem::Geometry<3> geometry(shape.points, shape.elements);
  const Eigen::Index n = shape.points.rows(), far = n - 1;
  Observations data{Eigen::SparseMatrix<double>(n, n), Eigen::VectorXd::LinSpaced(n, -1, 1)};
  data.P.setIdentity();
  data.P.coeffRef(0, far) = data.P.coeffRef(far, 0) = 0.5;
  data.P.makeCompressed();
  const BendingMatrices bending(geometry, data.P);
  const SmoothMoves<3> prior(bending, geometry, geometry.directions().rowwise().normalized(),
                             kLength);
  const Eigen::SparseMatrix<double> Q = prior.precision(1, Eigen::VectorXd::Ones(n));
  const Posterior posterior(bending.cholesky(), Q, data, prior.smoothing());
  const Eigen::VectorXd rhs = Q * prior.smoothing() + data.b;
  EXPECT_LT((Q * posterior.mean() + data.P * posterior.mean() - rhs).norm(), 1e-9 * rhs.norm());
}

}  // namespace
}  // namespace surf::segment
