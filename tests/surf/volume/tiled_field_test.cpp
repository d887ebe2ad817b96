#include "libsurf/volume/tiled_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <random>

#include "libsurf/base/threads.h"

namespace surf::volume {
namespace {

using Eigen::Vector3d;

Grid grid(const std::array<int, 3>& size, const Eigen::Affine3d& affine) { return {size, affine}; }

Eigen::Affine3d scaled(double spacing) { return Eigen::Affine3d(Eigen::Scaling(spacing)); }

/// Turned, sheared, anisotropic, shifted; mirrored if asked for.
Eigen::Affine3d awkward_affine(bool is_mirrored) {
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(1, 2) = 0.3;
  Eigen::Affine3d affine =
      Eigen::Translation3d(10, -20, 5) * Eigen::AngleAxisd(0.6, Vector3d(1, 2, -1).normalized()) *
      Eigen::Affine3d(shear) * Eigen::Scaling(0.7, is_mirrored ? -1.1 : 1.1, 2.5);
  return affine;
}

NodalValues from_index(const std::function<double(const Vector3d&)>& f) {
  return [f](const std::array<int, 3>& lower, const std::array<int, 3>& upper, float* out) {
    for (int k = lower[2]; k < upper[2]; ++k)
      for (int j = lower[1]; j < upper[1]; ++j)
        for (int i = lower[0]; i < upper[0]; ++i) *out++ = static_cast<float>(f(Vector3d(i, j, k)));
  };
}

/// White noise in [-1, 1], a pure function of the index (the finaliser of splitmix64).
double noise(const Vector3d& index) {
  auto bits = static_cast<std::uint64_t>(1e12 + index.dot(Vector3d(1, 1009, 1000003)));
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
  bits ^= bits >> 31;
  return 2 * std::ldexp(static_cast<double>(bits >> 11), -53) - 1;
}

/// Points inside a box of index space, mapped to the world.
Points<3> random_points(const Eigen::Affine3d& affine, const Vector3d& lower, const Vector3d& upper,
                        int n) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  Points<3> out(n, 3);
  for (int i = 0; i < n; ++i) {
    const Vector3d u(uniform(generator), uniform(generator), uniform(generator));
    out.row(i) = affine * (lower + u.cwiseProduct(upper - lower));
  }
  return out;
}

Samples<3> sampled(const Field<3>& field, const Points<3>& x) {
  Samples<3> samples;
  field.sample(x, Derivatives::kSecond, samples);
  return samples;
}

class AwkwardFrames : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(TiledField, AwkwardFrames, ::testing::Bool(), [](const auto& mirrored) {
  return mirrored.param ? "Mirrored" : "Direct";
});

// A linear function of the world, sampled at the voxels, is reproduced with its gradient.
TEST_P(AwkwardFrames, ReproduceLinearFunctions) {
  const Eigen::Affine3d affine = awkward_affine(GetParam());
  const Vector3d slope(0.3, -0.2, 0.5);
  const TiledField field(grid({40, 36, 34}, affine), from_index([&](const Vector3d& index) {
                           return slope.dot(affine * index);
                         }));
  const Points<3> x =
      random_points(affine, Vector3d::Constant(-0.5), Vector3d(39.5, 35.5, 33.5), 300);
  const Samples<3> samples = sampled(field, x);
  constexpr double kFloat = 1e-5;  // values up to 60 in float, differences of them / 0.7 mm
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    EXPECT_NEAR(samples.value[i], slope.dot(x.row(i)), kFloat);
    EXPECT_LT((samples.gradient.row(i).transpose() - slope).norm(), 2 * kFloat);
    EXPECT_LT(samples.hessian.row(i).norm(), 8 * kFloat);
  }
}

// Differences across cells and tiles, on white noise. The third derivative of the spline jumps at
// the nodes, so the difference of the gradient has an error of kStep times that jump there.
TEST_P(AwkwardFrames, GiveTheGradientAndHessianOfTheirValues) {
  const Eigen::Affine3d affine = awkward_affine(GetParam());
  const TiledField field(grid({40, 36, 34}, affine), from_index(noise));
  Points<3> x = random_points(affine, Vector3d::Constant(1), Vector3d(38, 34, 32), 200);
  const Eigen::Affine3d to_index = affine.inverse();
  for (int i = 0; i < 60; ++i) {  // on the planes between tiles, cells, and one step before them
    Vector3d u = to_index * Vector3d(x.row(i));
    u[i % 3] = i % 2 ? 16 : std::round(u[i % 3]) - 1e-9;
    x.row(i) = affine * u;
  }
  constexpr double kStep = 1e-5;  // mm
  const Samples<3> at = sampled(field, x);
  const double gradient_scale = at.gradient.cwiseAbs().maxCoeff();
  const double hessian_scale = at.hessian.cwiseAbs().maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::RowVector3d step = kStep * Eigen::RowVector3d::Unit(axis);
    const Samples<3> plus = sampled(field, x.rowwise() + step);
    const Samples<3> minus = sampled(field, x.rowwise() - step);
    const Eigen::VectorXd slope = (plus.value - minus.value) / (2 * kStep);
    EXPECT_LT((slope - at.gradient.col(axis)).cwiseAbs().maxCoeff(), 1e-8 * gradient_scale);
    for (int other = 0; other < 3; ++other) {
      const Eigen::VectorXd second =
          (plus.gradient.col(other) - minus.gradient.col(other)) / (2 * kStep);
      EXPECT_LT((second - at.hessian.col(3 * axis + other)).cwiseAbs().maxCoeff(),
                1e-4 * hessian_scale);
    }
  }
}

// C^2: value, gradient and Hessian do not jump where cells, and where tiles meet.
TEST(TiledField, IsTwiceContinuouslyDifferentiableAcrossCellsAndTiles) {
  const TiledField field(grid({50, 50, 50}, scaled(1)), from_index(noise));
  constexpr double kGap = 1e-9;  // times the third derivative, about 10
  for (const double plane : {7.0, 15.0, 16.0, 17.0, 32.0})
    for (int axis = 0; axis < 3; ++axis) {
      Points<3> before = random_points(scaled(1), Vector3d::Ones(), Vector3d::Constant(48), 50);
      before.col(axis).setConstant(plane - kGap);
      Points<3> after = before;
      after.col(axis).setConstant(plane + kGap);
      const Samples<3> a = sampled(field, before), b = sampled(field, after);
      EXPECT_LT((a.value - b.value).cwiseAbs().maxCoeff(), 20 * kGap);
      EXPECT_LT((a.gradient - b.gradient).cwiseAbs().maxCoeff(), 20 * kGap);
      EXPECT_LT((a.hessian - b.hessian).cwiseAbs().maxCoeff(), 40 * kGap);
    }
}

TEST(TiledField, StaysWithinTheRangeOfItsNodalValues) {
  const TiledField field(grid({20, 20, 20}, scaled(1)), from_index([](const Vector3d& index) {
                           return index[0] < 10 ? 0.0 : 1.0;
                         }));
  const Samples<3> samples =
      sampled(field, random_points(scaled(1), Vector3d::Zero(), Vector3d::Constant(19), 2000));
  EXPECT_GE(samples.value.minCoeff(), 0);
  EXPECT_LE(samples.value.maxCoeff(), 1 + 1e-15);
}

TEST(TiledField, SumsToOneOnConstants) {
  const TiledField field(grid({20, 20, 20}, scaled(1)),
                         from_index([](const Vector3d&) { return 0.75; }));
  const Samples<3> samples =
      sampled(field, random_points(scaled(1), Vector3d::Constant(-5), Vector3d::Constant(30), 500));
  EXPECT_LT((samples.value.array() - 0.75).abs().maxCoeff(), 1e-15);
  EXPECT_LT(samples.gradient.cwiseAbs().maxCoeff(), 1e-15);
}

TEST(TiledField, ReachesToTheOuterFacesAndIsContinuedConstantlyBeyond) {
  const TiledField field(grid({20, 20, 20}, scaled(1)), from_index(noise));
  Points<3> x(3, 3), nearest(3, 3);
  x << -4, 7.3, 9.1, 25, -1, 30, 5.5, 6.5, 19.6;
  nearest << -0.5, 7.3, 9.1, 19.5, -0.5, 19.5, 5.5, 6.5, 19.5;
  const Samples<3> outside = sampled(field, x), inside = sampled(field, nearest);
  EXPECT_EQ(outside.value, inside.value);
  EXPECT_EQ(outside.gradient(0, 0), 0);
  EXPECT_EQ(outside.gradient(0, 1), inside.gradient(0, 1));
  EXPECT_EQ(outside.gradient.row(1).norm(), 0);
  EXPECT_EQ(outside.hessian.row(1).norm(), 0);
}

/// Values at the points, asked for in a given order of batches of different sizes.
Eigen::VectorXd in_batches(const TiledField& field, const Points<3>& x, unsigned seed) {
  std::vector<Eigen::Index> order(x.rows());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 generator(seed);
  std::shuffle(order.begin(), order.end(), generator);
  Eigen::VectorXd out(x.rows());
  Samples<3> samples;
  for (std::size_t begin = 0; begin < order.size();) {
    const std::size_t n = std::min<std::size_t>(1 + generator() % 200, order.size() - begin);
    Points<3> batch(n, 3);
    for (std::size_t i = 0; i < n; ++i) batch.row(i) = x.row(order[begin + i]);
    field.sample(batch, Derivatives::kNone, samples);
    for (std::size_t i = 0; i < n; ++i) out[order[begin + i]] = samples.value[i];
    begin += n;
  }
  return out;
}

TEST(TiledField, DoesNotDependOnTheOrderOfUseOrTheNumberOfThreads) {
  const Eigen::Affine3d affine = awkward_affine(false);
  const Grid nodes = grid({60, 50, 40}, affine);
  const Points<3> x = random_points(affine, Vector3d::Zero(), Vector3d(59, 49, 39), 5000);
  Samples<3> reference;
  {
    const ThreadLimit one(1);
    TiledField(nodes, from_index(noise)).sample(x, Derivatives::kSecond, reference);
  }
  for (const int n_threads : {1, 2, 4}) {
    const ThreadLimit limit(n_threads);
    const TiledField field(nodes, from_index(noise));
    EXPECT_EQ(in_batches(field, x, n_threads), [&] {
      Samples<3> values;
      field.sample(x, Derivatives::kNone, values);
      return values.value;
    }());
    const Samples<3> again = sampled(field, x);
    EXPECT_EQ(again.value, reference.value);
    EXPECT_EQ(again.gradient, reference.gradient);
    EXPECT_EQ(again.hessian, reference.hessian);
  }
}

TEST(TiledField, ComputesOnlyTheTilesThatAreAskedFor) {
  const TiledField field(grid({64, 64, 64}, scaled(1)), from_index(noise));
  EXPECT_EQ(field.n_tiles(), 0u);
  Points<3> x(3, 3);
  x << 3, 3, 3, 15.9, 3, 3, 16.1, 3, 3;
  sampled(field, x);
  EXPECT_EQ(field.n_tiles(), 2u);
  EXPECT_GT(field.memory_bytes(), 2u * 16 * 16 * 16 * sizeof(float));
}

}  // namespace
}  // namespace surf::volume
