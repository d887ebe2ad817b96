#include "libsurf/mesh/fit_ellipsoid.h"

#include <Eigen/Geometry>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "tests/surf/fixtures.h"

namespace surf::mesh {
namespace {

IN_BOTH_DIMENSIONS(FitEllipsoid);

template <int Dim>
Eigen::Matrix<double, Dim, Dim> turn(unsigned seed) {
  std::srand(seed);
  const Eigen::Matrix<double, Dim, Dim> random = Eigen::Matrix<double, Dim, Dim>::Random();
  return Eigen::HouseholderQR<Eigen::Matrix<double, Dim, Dim>>(random).householderQ();
}

/// n points on the unit sphere, spread at random.
template <int Dim>
Points<Dim> directions(unsigned seed, int n) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  Points<Dim> out(n, Dim);
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = normal(generator);
  return out.rowwise().normalized();
}

template <int Dim>
Vector<Dim> lengths() {
  return Vector<Dim>::LinSpaced(24, 12);
}

TYPED_TEST(FitEllipsoid, FindsTheOneThatThePointsLieOn) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> center = Vector<Dim>::LinSpaced(-40, 95);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Eigen::Matrix<double, Dim, Dim> axes = turn<Dim>(seed) * lengths<Dim>().asDiagonal();
    const Points<Dim> points =
        (directions<Dim>(seed, 20) * axes.transpose()).rowwise() + center.transpose();
    const Ellipsoid<Dim> fit = fit_ellipsoid<Dim>(points);
    constexpr double kPull = 3e-3;  // towards a ball, of the size
    EXPECT_LT((fit.center - center).norm(), kPull * 24);
    EXPECT_LT(fit.rms, kPull * 24);
    for (int i = 0; i < Dim; ++i) {
      EXPECT_NEAR(fit.axes.col(i).norm(), lengths<Dim>()[i], kPull * 24);
      EXPECT_NEAR(std::abs(fit.axes.col(i).normalized().dot(axes.col(i).normalized())), 1, kPull);
    }
  }
}

TYPED_TEST(FitEllipsoid, IsABallForTheFewestPoints) {
  constexpr int Dim = TypeParam::value;
  Points<Dim> points(Dim + 1, Dim);
  points.setConstant(-1 / std::sqrt(double(Dim)));
  for (int i = 0; i < Dim; ++i) points.row(i) = 10 * Vector<Dim>::Unit(i).transpose();
  points.row(Dim) *= 10;
  const Ellipsoid<Dim> fit = fit_ellipsoid<Dim>(points);
  EXPECT_LT(fit.center.norm(), 1.0);
  for (int i = 0; i < Dim; ++i) EXPECT_NEAR(fit.axes.col(i).norm(), 10, 1);
}

// Clicks are off by a voxel or so: the fit is off by less.
TYPED_TEST(FitEllipsoid, AveragesTheErrorsOfThePoints) {
  constexpr int Dim = TypeParam::value;
  std::mt19937 generator(7);
  std::normal_distribution<double> normal(0, 0.5);
  Points<Dim> points = directions<Dim>(3, 60) * lengths<Dim>().asDiagonal();
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] += normal(generator);
  const Ellipsoid<Dim> fit = fit_ellipsoid<Dim>(points);
  EXPECT_LT(fit.center.norm(), 0.5);
  EXPECT_NEAR(fit.rms, 0.5, 0.15);
  for (int i = 0; i < Dim; ++i) EXPECT_NEAR(fit.axes.col(i).norm(), lengths<Dim>()[i], 0.6);
}

TYPED_TEST(FitEllipsoid, FollowsTheFrameAndTheUnitOfThePoints) {
  constexpr int Dim = TypeParam::value;
  const Points<Dim> points = directions<Dim>(4, 12) * lengths<Dim>().asDiagonal();
  const Ellipsoid<Dim> fit = fit_ellipsoid<Dim>(points);
  const Eigen::Matrix<double, Dim, Dim> R = turn<Dim>(9);
  const Vector<Dim> shift = Vector<Dim>::LinSpaced(5, -300);
  for (const double scale : {1e-3, 1.0, 1e3}) {
    const Points<Dim> moved = (scale * points * R.transpose()).rowwise() + shift.transpose();
    const Ellipsoid<Dim> other = fit_ellipsoid<Dim>(moved);
    const double kRounding = 1e-5 * scale * 24 + 1e-12 * 300;
    EXPECT_LT((other.center - (scale * R * fit.center + shift)).norm(), kRounding);
    EXPECT_NEAR(other.rms, scale * fit.rms, kRounding);
    EXPECT_LT((other.axes * other.axes.transpose() -
               scale * scale * R * fit.axes * fit.axes.transpose() * R.transpose())
                  .norm(),
              kRounding * scale * 24);
  }
}

TEST(FitEllipsoidInSpace, IsABallForPointsInAPlane) {
  Points<3> points(12, 3);
  for (int i = 0; i < 12; ++i)
    points.row(i) << 8 * std::cos(i * std::numbers::pi / 6), 8 * std::sin(i * std::numbers::pi / 6),
        30;
  const Ellipsoid<3> fit = fit_ellipsoid<3>(points);
  EXPECT_LT((fit.center - Vector<3>(0, 0, 30)).norm(), 0.01);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(fit.axes.col(i).norm(), 8, 0.01);
}

/// What fit_ellipsoid() says in the log.
template <int Dim>
std::vector<std::string> warnings(const Points<Dim>& points) {
  std::vector<std::string> out;
  set_log_sink([&](LogLevel, const std::string& message) { out.push_back(message); });
  fit_ellipsoid<Dim>(points);
  set_log_sink({});
  return out;
}

TEST(FitEllipsoidInSpace, WarnsWherePointsHardlyDetermineIt) {
  EXPECT_TRUE(warnings<3>(directions<3>(3, 60) * lengths<3>().asDiagonal()).empty());
  Points<3> cloud(7, 3);
  cloud << 0, -10, -6, 2, 16, -15, -28, -6, -2, 10, -14, 2, 4, 8, -3, -9, -2, -3, -5, -4, 5;
  const std::vector<std::string> found = warnings<3>(cloud);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("the points hardly determine it"), std::string::npos) << found[0];
}

TYPED_TEST(FitEllipsoid, SaysWhenThePointsDoNotDo) {
  constexpr int Dim = TypeParam::value;
  EXPECT_THROW(fit_ellipsoid<Dim>(directions<Dim>(1, Dim)), UsageError);
  Points<Dim> line(9, Dim);
  for (int i = 0; i < 9; ++i) line.row(i).setConstant(i);
  EXPECT_THROW(fit_ellipsoid<Dim>(line), UsageError);
}

}  // namespace
}  // namespace surf::mesh
