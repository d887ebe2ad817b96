#include "libsurf/flow/detail/trust_region.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace surf::flow {
namespace {

constexpr int kSize = 20;

/// H = Q diag(eigenvalues) Q^T with a random orthogonal Q, and P diagonal.
struct Problem {
  explicit Problem(double smallest) {
    std::srand(5);
    const Eigen::MatrixXd random = Eigen::MatrixXd::Random(kSize, kSize);
    const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(random).householderQ();
    H = Q * Eigen::VectorXd::LinSpaced(kSize, smallest, 10).asDiagonal() * Q.transpose();
    P = Eigen::VectorXd::LinSpaced(kSize, 1, 3);
    g = Eigen::VectorXd::Random(kSize);
    q = Eigen::VectorXd::Random(kSize);
  }

  QuadraticModel model() const {
    QuadraticModel out;
    out.gradient = g;
    out.hessian = [this](const Eigen::VectorXd& V) -> Eigen::VectorXd { return H * V; };
    out.preconditioner = [this](const Eigen::VectorXd& r) -> Eigen::VectorXd {
      return r.cwiseQuotient(P);
    };
    return out;
  }
  double norm(const Eigen::VectorXd& V) const { return std::sqrt(V.cwiseAbs2().dot(P)); }

  Eigen::MatrixXd H;
  Eigen::VectorXd P, g, q;
};

constexpr TrustRegionOptions kExact{.tolerance = 1e-13, .max_iterations = 100};

TEST(TrustRegion, TakesNewtonsStepWhereItIsPositiveDefiniteAndWideEnough) {
  const Problem problem(0.5);
  const auto step = minimise_in_trust_region(problem.model(), 1e3, kExact);
  EXPECT_LT((step.V + problem.H.ldlt().solve(problem.g)).norm(), 1e-10 * step.V.norm());
  EXPECT_NEAR(step.norm, problem.norm(step.V), 1e-10 * step.norm);
  EXPECT_FALSE(step.is_at_boundary);
  EXPECT_FALSE(step.has_negative_curvature);
}

TEST(TrustRegion, StopsAtItsBoundaryAndDescendsAtLeastAsFarAsSteepestDescent) {
  for (const double smallest : {0.5, -3.0})
    for (const double radius : {1e-3, 0.1, 0.3}) {
      const Problem problem(smallest);
      const auto step = minimise_in_trust_region(problem.model(), radius, kExact);
      EXPECT_TRUE(step.is_at_boundary);
      EXPECT_NEAR(problem.norm(step.V), radius, 1e-10 * radius);
      const Eigen::VectorXd down = -problem.g.cwiseQuotient(problem.P);
      EXPECT_LE(problem.model()(step.V),
                problem.model()(radius / problem.norm(down) * down) + 1e-14);
    }
}

TEST(TrustRegion, FindsNegativeCurvature) {
  const Problem problem(-3);
  const auto step = minimise_in_trust_region(problem.model(), 100, kExact);
  EXPECT_TRUE(step.has_negative_curvature);
  EXPECT_NEAR(problem.norm(step.V), 100, 1e-8);
  EXPECT_LT(problem.model()(step.V), -100);
}

TEST(TrustRegion, MeetsTheConstraintAndIsOptimalUnderIt) {
  const Problem problem(0.5);
  QuadraticModel model = problem.model();
  model.constraint = problem.q;
  const auto step = minimise_in_trust_region(model, 1e3, kExact);
  Eigen::MatrixXd saddle = Eigen::MatrixXd::Zero(kSize + 1, kSize + 1);
  saddle.topLeftCorner(kSize, kSize) = problem.H;
  saddle.topRightCorner(kSize, 1) = problem.q;
  saddle.bottomLeftCorner(1, kSize) = problem.q.transpose();
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(kSize + 1);
  rhs.head(kSize) = -problem.g;
  const Eigen::VectorXd expected = saddle.partialPivLu().solve(rhs).head(kSize);
  EXPECT_LT(std::abs(problem.q.dot(step.V)), 1e-12);
  EXPECT_LT((step.V - expected).norm(), 1e-10 * expected.norm());
}

}  // namespace
}  // namespace surf::flow
