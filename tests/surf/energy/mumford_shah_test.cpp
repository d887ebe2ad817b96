#include "libsurf/energy/mumford_shah.h"

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

/// About the cube [-2, 2]^3, turned and with three spacings.
volume::Grid oblique_grid(int n) {
  volume::Grid grid{{n + 1, n + 1, n + 1}, Eigen::Affine3d::Identity()};
  grid.index_to_world.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()) *
                                 Eigen::Vector3d(1, 1.2, 0.9).asDiagonal() *
                                 Eigen::Matrix3d::Identity() * (4.0 / n);
  grid.index_to_world.translation() =
      -grid.index_to_world.linear() * Eigen::Vector3d::Constant(0.5 * n);
  return grid;
}

MumfordShahOptions options(double mu, double gamma) {
  MumfordShahOptions out;
  out.mu = mu;
  out.gamma = gamma;
  out.contrast = 0.5;
  out.solver.tolerance = 1e-12;
  return out;
}

/// 1 inside the ball of radius 0.8 about the origin and 0 outside, with a smooth step between.
class SoftBall : public Field<3> {
 public:
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    constexpr double kWidth = 0.1;
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const double r = x.row(i).norm(), t = std::tanh((0.8 - r) / kWidth);
      out.value[i] = (1 + t) / 2;
      if (order >= Derivatives::kFirst)
        out.gradient.row(i) = -(1 - t * t) / (2 * kWidth) / std::max(r, 1e-9) * x.row(i);
    }
  }
};

fem::Curvature curvature_of(const fem::Geometry<3>& shape) {
  return fem::curvature<3>(shape,
                           fem::stiffness<3>(shape, Eigen::VectorXd::Ones(shape.n_elements())));
}

ShapeTerms<3> terms_of(const MumfordShah& energy, const fem::Geometry<3>& shape) {
  ShapeTerms<3> terms(shape);
  energy.differentiate(curvature_of(shape), 1, terms);
  return terms;
}

TEST(MumfordShah, DerivativeIsTheDifferenceQuotientOfTheValue) {
  constexpr double kStep = 1e-4;       // truncation ~ kStep^2
  constexpr double kTolerance = 1e-6;  // of the sum of |derivative|
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const auto shape = test::smooth_geometry<3>(seed, 3);
    const Points<3> W = test::random_smooth_vectors<3>(shape.points(), 100 + seed);
    MumfordShah energy(std::make_shared<const test::WaveField<3>>(seed), oblique_grid(24),
                       options(0.05, seed == 2 ? 0.3 : 0));
    energy.reset(shape);
    const ShapeTerms<3> terms = terms_of(energy, shape);
    const double exact = terms.derivative.cwiseProduct(W).sum();
    const double plus = energy.try_move(shape.moved_to(shape.points() + kStep * W));
    const double minus = energy.try_move(shape.moved_to(shape.points() - kStep * W));
    const double scale = terms.derivative.cwiseProduct(W).cwiseAbs().sum();
    EXPECT_NEAR(exact, (plus - minus) / (2 * kStep), kTolerance * scale) << "seed " << seed;
  }
}

// The whole gradient stands where Theorem 2.2.10 has the tangential one: the rest vanishes with h.
TEST(MumfordShah, DerivativeConvergesWithTheGrid) {
  const auto field = std::make_shared<const test::WaveField<3>>(2);
  const auto shape = test::smooth_geometry<3>(2, 4);
  const Points<3> W = test::random_smooth_vectors<3>(shape.points(), 3);
  std::vector<double> values;
  for (const int n : {16, 32, 64}) {
    MumfordShah energy(field, oblique_grid(n), options(0.1, 0));
    energy.reset(shape);
    values.push_back(terms_of(energy, shape).derivative.cwiseProduct(W).sum());
  }
  EXPECT_GT(std::abs(values[0] - values[1]), 1.8 * std::abs(values[1] - values[2]))
      << values[0] << ", " << values[1] << ", " << values[2];
}

TEST(MumfordShah, IsLeastOnTheEdgeAndPushesTheSurfaceThereFromBothSides) {
  MumfordShah energy(std::make_shared<const SoftBall>(), oblique_grid(32), options(0.05, 0));
  std::vector<double> values;
  for (const double radius : {0.6, 0.8, 1.0}) {
    auto arrays = test::unit_sphere<3>(4);
    const fem::Geometry<3> shape(radius * arrays.X, arrays.T);
    energy.reset(shape);
    values.push_back(energy.value());
    const ShapeTerms<3> terms = terms_of(energy, shape);
    const double G = terms.derivative.cwiseProduct(shape.nodal_normals()).sum() / shape.measure();
    if (radius < 0.8) {
      EXPECT_LT(G, -0.01);
    }
    if (radius > 0.8) {
      EXPECT_GT(G, 0.01);
    }
    if (radius == 0.8) {
      EXPECT_GT(terms.beta.minCoeff(), 0);  // d_nu I < 0 where u_1 > u_2
    }
  }
  EXPECT_LT(values[1], 0.5 * values[0]);
  EXPECT_LT(values[1], 0.5 * values[2]);
}

TEST(MumfordShah, IsContinuedWithoutAJumpWhereTheBoxGrows) {
  MumfordShahOptions small = options(0.01, 0.1);
  small.margin = 4;
  auto arrays = test::unit_sphere<3>(3);
  arrays.X *= 0.4;
  fem::Geometry<3> shape(arrays.X, arrays.T);
  const auto field = std::make_shared<const test::WaveField<3>>(3);
  MumfordShah energy(field, oblique_grid(40), small);
  energy.reset(shape);
  double expected = energy.value();
  for (int step = 0; step < 8; ++step) {  // to radius 0.8, the box grows with it
    const ShapeTerms<3> before = terms_of(energy, shape);
    const fem::Geometry<3> moved = shape.moved_to((1 + 0.1 / (1 + step * 0.1)) * shape.points());
    const double value = energy.try_move(moved);
    energy.accept();
    const ShapeTerms<3> after = terms_of(energy, moved);
    const Points<3> d = moved.points() - shape.points();
    // trapezoidal rule along the move
    expected += 0.5 * (before.derivative + after.derivative).cwiseProduct(d).sum();
    shape = moved;
    EXPECT_NEAR(value, energy.value(), 1e-12);
    EXPECT_NEAR(value, expected, 0.01 * std::abs(expected)) << step;
  }
}

TEST(MumfordShah, IsContinuousOverSurgery) {
  auto arrays = test::unit_sphere<3>(2);
  const auto ball = [&](double radius) { return fem::Geometry<3>(radius * arrays.X, arrays.T); };
  const auto field = std::make_shared<const SoftBall>();
  MumfordShah energy(field, oblique_grid(20), options(0.01, 0.1)),
      anew(field, oblique_grid(20), options(0.01, 0.1));
  energy.reset(ball(0.7));
  const double before = energy.value();
  energy.rebuild(ball(0.6));
  anew.reset(ball(0.7));
  anew.remesh(ball(0.6));
  EXPECT_NEAR(energy.value(), before, 1e-12);
  EXPECT_GT(std::abs(energy.drift()), 0.01 * std::abs(before));
  EXPECT_NEAR(energy.value() + energy.drift(), anew.value(), 1e-9);
  EXPECT_NEAR(energy.try_move(ball(0.65)) - energy.value(),
              anew.try_move(ball(0.65)) - anew.value(), 1e-9);
}

TEST(MumfordShah, DoesNotFeelAffineMapsOfTheIntensities) {
  constexpr double kTolerance = 1e-9;  // of solver and rounding
  const auto I = std::make_shared<const test::WaveField<3>>(3);
  class Mapped : public Field<3> {
   public:
    explicit Mapped(std::shared_ptr<const Field<3>> I) : I_(std::move(I)) {}
    void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
      I_->sample(x, order, out);
      out.value = (40 * out.value.array() - 1000).matrix();
      out.gradient *= 40;
    }

   private:
    std::shared_ptr<const Field<3>> I_;
  };
  const auto shape = test::smooth_geometry<3>(4, 3);
  MumfordShahOptions scaled = options(0.05, 0.1);
  MumfordShah first(I, oblique_grid(24), scaled);
  scaled.contrast *= 40;
  MumfordShah second(std::make_shared<const Mapped>(I), oblique_grid(24), scaled);
  first.reset(shape);
  second.reset(shape);
  EXPECT_NEAR(first.value(), second.value(), kTolerance * first.value());
  const ShapeTerms<3> a = terms_of(first, shape), b = terms_of(second, shape);
  EXPECT_LT((a.derivative - b.derivative).norm(), kTolerance * a.derivative.norm());
  EXPECT_LT((a.beta - b.beta).norm(), kTolerance * a.beta.norm());
}

/// J and its derivative for one wavy shape about the origin.
struct Outcome {
  double value;
  Points<3> derivative;
};
Outcome outcome_on(const volume::Grid& grid, const MumfordShahOptions& how) {
  const auto arrays = test::random_smooth_shape<3>(4, 3);
  const fem::Geometry<3> shape(0.6 * arrays.X, arrays.T);
  MumfordShah energy(std::make_shared<const test::WaveField<3>>(3), grid, how);
  energy.reset(shape);
  return {energy.value(), terms_of(energy, shape).derivative};
}

// The same nodes with their axes mirrored and permuted.
TEST(MumfordShah, DoesNotFeelTheOrderAndDirectionOfTheAxes) {
  constexpr double kTolerance = 1e-9;  // of solver and rounding
  const volume::Grid grid = oblique_grid(24);
  const Outcome plain = outcome_on(grid, options(0.05, 0.1));
  volume::Grid other = grid;
  const Eigen::Matrix3d L = grid.index_to_world.linear();
  other.index_to_world.linear() << L.col(1), -L.col(0), L.col(2);
  other.index_to_world.translation() = grid.index_to_world * Eigen::Vector3d(24, 0, 0);
  const Outcome turned = outcome_on(other, options(0.05, 0.1));
  EXPECT_NEAR(plain.value, turned.value, kTolerance * plain.value);
  EXPECT_LT((plain.derivative - turned.derivative).norm(), kTolerance * plain.derivative.norm());
}

TEST(MumfordShah, HardlyFeelsWhatIsFarAway) {
  constexpr double kTolerance = 2e-3;  // the sides of the smaller one are 4 sqrt(mu) away: exp(-8)
  const volume::Grid small = oblique_grid(32);
  volume::Grid large = small;
  for (int& size : large.size) size += 20;
  large.index_to_world.translate(Eigen::Vector3d::Constant(-10));
  MumfordShahOptions how = options(0.05, 0.1);
  how.margin = 30;  // all of the image
  const Outcome near = outcome_on(small, how), far = outcome_on(large, how);
  EXPECT_LT((near.derivative - far.derivative).norm(), kTolerance * near.derivative.norm());
}

double second_error(int level, int n) {
  return test::second_derivative_error<3>(level, [&](const fem::Geometry<3>&, unsigned seed) {
    return std::make_unique<MumfordShah>(std::make_shared<const test::WaveField<3>>(seed),
                                         oblique_grid(n), options(0.05, 0.3));
  });
}

// Theorem 2.2.11, u' included: without the operator of u' the error is far above the bound.
TEST(MumfordShah, SecondDerivativeConvergesToTheDifferenceQuotient) {
  const double coarse = second_error(2, 16), fine = second_error(3, 32);
  EXPECT_LT(fine, 0.1);
  EXPECT_LT(fine, 0.6 * coarse);
}

TEST(MumfordShah, SecondDerivativeIsSymmetricAndProportionalToItsWeight) {
  const auto smooth = test::smooth_shape<3>(4, 2);
  const fem::Geometry<3> shape(smooth.X, smooth.T);
  MumfordShah J(std::make_shared<const SoftBall>(), oblique_grid(20), options(0.05, 0.1));
  J.reset(shape);
  const auto A = fem::stiffness<3>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  SecondDerivative<3> once(shape), thrice(shape);
  J.differentiate_twice(curvature_of(shape), 1, once);
  J.differentiate_twice(curvature_of(shape), 3, thrice);
  const Eigen::VectorXd V = test::smooth_function<3>(smooth.X, 1),
                        W = test::smooth_function<3>(smooth.X, 2);
  const Eigen::VectorXd product = once.times(shape, A, W);
  EXPECT_LT((thrice.times(shape, A, W) - 3 * product).norm(), 1e-9 * product.norm());
  EXPECT_NEAR(V.dot(product), W.dot(once.times(shape, A, V)), 1e-9 * V.norm() * product.norm());
}

TEST(MumfordShah, RefusesWeightsBelowZero) {
  EXPECT_THROW(MumfordShah(std::make_shared<const SoftBall>(), oblique_grid(16), options(-1, 0)),
               UsageError);
}

// A hole opens where u is far from I and the mean outside is not.
TEST(MumfordShah, DensityIsPositiveInADarkCavity) {
  class Shell : public Field<3> {
   public:
    void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
      out.resize(x.rows(), order);
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const double r = x.row(i).norm();
        out.value[i] = r > 0.3 && r < 0.9;
      }
      out.gradient.setZero();
    }
  };
  auto arrays = test::unit_sphere<3>(3);
  const fem::Geometry<3> shape(0.9 * arrays.X, arrays.T);
  MumfordShah energy(std::make_shared<const Shell>(), oblique_grid(40), options(0.5, 0));
  energy.reset(shape);
  Points<3> points(2, 3);
  points << 0, 0, 0, 0.6, 0, 0;
  Eigen::VectorXd density = Eigen::VectorXd::Zero(2);
  energy.add_density(points, 1, density);
  EXPECT_GT(density[0], 0);
  EXPECT_LT(density[1], 0);
}

}  // namespace
}  // namespace surf::energy
