#include "libsurf/segment/detail/edge_offset.h"

#include <gtest/gtest.h>

#include "libsurf/energy/boundary_integral.h"
#include "libsurf/mesh/primitives.h"

namespace surf::segment {
namespace {

/// A valley of width w along the sphere of radius R: H = 1 - 0.9 exp(-(r - R)^2 / (2 w^2)).
class Valley : public Field<3> {
 public:
  Valley(double R, double w) : R_(R), w_(w) {}
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<3> p = x.row(i);
      const double r = p.norm();
      const auto [value, first, second] = profile(r);
      const Vector<3> nu = p / r;
      out.value[i] = value;
      if (order >= Derivatives::kFirst) out.gradient.row(i) = first * nu;
      if (order < Derivatives::kSecond) continue;
      const Eigen::Matrix3d h = second * nu * nu.transpose() +
                                first / r * (Eigen::Matrix3d::Identity() - nu * nu.transpose());
      out.hessian.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(h.data());
    }
  }
  /// Value and two derivatives along the radius.
  std::array<double, 3> profile(double r) const {
    const double t = (r - R_) / w_, e = 0.9 * std::exp(-t * t / 2);
    return {1 - e, e * t / w_, e * (1 - t * t) / (w_ * w_)};
  }

 private:
  double R_, w_;
};

constexpr double kRadius = 20, kWidth = 2;

/// Where 2 H / r + H' = 0: the radius of the minimal sphere, just inside the valley.
double minimiser(const Valley& H) {
  double low = kRadius - kWidth / 2, high = kRadius;
  for (int k = 0; k < 60; ++k) {
    const double r = (low + high) / 2;
    const auto [value, first, second] = H.profile(r);
    (2 * value / r + first > 0 ? high : low) = r;
  }
  return low;
}

Points<3> moved(const Triangles& surface, double blur_mm, double limit_mm) {
  energy::BoundaryIntegral<3> energy(std::make_shared<const Valley>(kRadius, kWidth));
  return moved_to_edge<3>(surface, energy, blur_mm, limit_mm);
}

Eigen::VectorXd radii(const Points<3>& X) { return X.rowwise().norm(); }

TEST(MovedToEdge, TakesTheBiasOfTheMinimalSurfaceOffABall) {
  const double r = minimiser(Valley(kRadius, kWidth));
  const double bias = kRadius - r;
  ASSERT_GT(bias, 0.03);
  const Triangles surface = mesh::ball(Eigen::Vector3d::Zero(), r, 2);
  // What is left is of second order in the bias over the width.
  EXPECT_LT((radii(moved(surface, 0, 1)).array() - kRadius).abs().maxCoeff(), 0.15 * bias);
}

// A blur of deviation s moves the level of a ball's edge by s^2 / R.
TEST(MovedToEdge, TakesTheBiasOfTheBlurOffABall) {
  constexpr double kBlur = 1.5;
  const Triangles surface =
      mesh::ball(Eigen::Vector3d::Zero(), minimiser(Valley(kRadius, kWidth)), 2);
  const double further = (radii(moved(surface, kBlur, 1)) - radii(moved(surface, 0, 1))).mean();
  EXPECT_NEAR(further, kBlur * kBlur / kRadius, 0.02 * kBlur * kBlur / kRadius);
}

TEST(MovedToEdge, MovesNoFurtherThanTheLimit) {
  const Triangles surface =
      mesh::ball(Eigen::Vector3d::Zero(), minimiser(Valley(kRadius, kWidth)), 2);
  constexpr double kLimit = 0.01;
  const Eigen::VectorXd moves = (moved(surface, 0, kLimit) - surface.points).rowwise().norm();
  EXPECT_LE(moves.maxCoeff(), kLimit * (1 + 1e-6));
  EXPECT_GT(moves.maxCoeff(), 0.9 * kLimit);
}

TEST(MovedToEdge, LeavesASurfaceWhereThereIsNoValley) {
  const Triangles surface = mesh::ball(Eigen::Vector3d::Zero(), kRadius - 2.5 * kWidth, 2);
  EXPECT_LT((moved(surface, 0, 1) - surface.points).norm(), 1e-12);
}

}  // namespace
}  // namespace surf::segment
