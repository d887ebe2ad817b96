// What holds for every shape energy: its derivative is that of the value the step control sees,
// moves add up, the scalar-product weights and the normal form G = g kappa + f.
#include "libsurf/energy/shape_energy.h"

#include <fmt/format.h>

#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

template <int Dim>
std::vector<test::EnergyCase<Dim>> all_energies(unsigned seed, double ray_spacing_mm = 0.02) {
  auto fields = test::wave_fields<Dim>(seed);
  fields.ray_spacing_mm = ray_spacing_mm;
  return test::every_energy<Dim>(fields);
}

IN_BOTH_DIMENSIONS(EveryEnergy);

template <int Dim>
void expect_difference_quotient(ShapeEnergy<Dim>& energy, const fem::Geometry<Dim>& shape,
                                const Points<Dim>& W, const std::string& what) {
  constexpr double kStep = 5e-5;               // truncation ~ kStep^2
  constexpr double kTolerance = 1e-7;          // of the sum of |derivative|
  constexpr double kRounding = 1e-14 / kStep;  // of |J|
  energy.reset(shape);
  ShapeTerms<Dim> terms(shape);
  energy.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
  const double exact = terms.derivative.cwiseProduct(W).sum();
  const double plus = energy.try_move(shape.moved_to(shape.points() + kStep * W));
  const double minus = energy.try_move(shape.moved_to(shape.points() - kStep * W));
  const double difference = (plus - minus) / (2 * kStep);
  const double scale = terms.derivative.cwiseAbs().sum();
  EXPECT_NEAR(exact, difference, kTolerance * scale + kRounding * std::abs(plus)) << what;
}

TYPED_TEST(EveryEnergy, DerivativeIsTheDifferenceQuotientOfTheValue) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto shape = test::smooth_geometry<Dim>(seed, Dim == 2 ? 4 : 3);
    const Points<Dim> W = test::random_smooth_vectors<Dim>(shape.points(), 100 + seed);
    for (auto& [name, energy] : all_energies<Dim>(seed)) {
      expect_difference_quotient<Dim>(*energy, shape, W, fmt::format("{}, seed {}", name, seed));
    }
  }
}

// The border closes the shape, and its rim is charged without its stretching: the value that the
// step control sees has the derivative all the same.
TYPED_TEST(EveryEnergy, DerivativeIsTheDifferenceQuotientWhereABorderCutsTheShapeOff) {
  constexpr int Dim = TypeParam::value;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    auto arrays = test::random_smooth_shape<Dim>(seed, Dim == 2 ? 4 : 3);
    const double plane = 0.4 * arrays.X.col(0).maxCoeff();
    fem::Border<Dim> border{Points<Dim>::Identity(1, Dim), {}};
    for (Eigen::Index i = 0; i < arrays.X.rows(); ++i) {
      border.planes.push_back(arrays.X(i, 0) >= plane);
      arrays.X(i, 0) = std::min(arrays.X(i, 0), plane);
    }
    const fem::Geometry<Dim> shape(arrays.X, arrays.T, border);
    ASSERT_TRUE(shape.has_border());
    Points<Dim> W = test::random_smooth_vectors<Dim>(arrays.X, 100 + seed);
    // Not across the plane, and no jump there: its slope over short elements would be steep.
    W.col(0).array() *= plane - arrays.X.col(0).array();
    for (auto& [name, energy] : all_energies<Dim>(seed)) {
      expect_difference_quotient<Dim>(*energy, shape, W, fmt::format("{}, seed {}", name, seed));
    }
  }
}

TYPED_TEST(EveryEnergy, DerivativeErrorFallsWithTheSquareOfTheStep) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(3, 3);
  const Points<Dim> W = test::random_smooth_vectors<Dim>(shape.points(), 7);
  for (auto& [name, energy] : all_energies<Dim>(3)) {
    energy->reset(shape);
    ShapeTerms<Dim> terms(shape);
    energy->differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
    const double exact = terms.derivative.cwiseProduct(W).sum();
    const auto error = [&, &energy = energy](double step) {
      const double plus = energy->try_move(shape.moved_to(shape.points() + step * W));
      const double minus = energy->try_move(shape.moved_to(shape.points() - step * W));
      return std::abs((plus - minus) / (2 * step) - exact);
    };
    const double order = std::log2(error(0.04) / error(0.02));
    EXPECT_GT(order, 1.8) << name;
    EXPECT_LT(order, 2.2) << name;
  }
}

TYPED_TEST(EveryEnergy, MovesAddUpToTheValueFromScratch) {
  constexpr int Dim = TypeParam::value;
  constexpr double kTolerance = 2e-5;  // two Gauss points per step of the swept volume
  const auto arrays = test::random_smooth_shape<Dim>(2, Dim == 2 ? 6 : 4);
  const Points<Dim> W = test::random_smooth_vectors<Dim>(arrays.X, 11);
  for (auto& [name, energy] : all_energies<Dim>(2)) {
    fem::Geometry<Dim> shape(arrays.X, arrays.T);
    energy->reset(shape);
    for (int step = 0; step < 5; ++step) {
      energy->try_move(shape.moved_to(shape.points() + 0.02 * W));
      energy->accept();
      shape = shape.moved_to(shape.points() + 0.02 * W);
    }
    const double moved = energy->value();
    energy->reset(shape);
    EXPECT_NEAR(moved, energy->value(), kTolerance * (1 + std::abs(moved))) << name;
  }
}

// derivative . n converges to <g kappa + f, phi> with f known for (5.1).
TYPED_TEST(EveryEnergy, NormalDerivativeConvergesToTheShapeGradient) {
  constexpr int Dim = TypeParam::value;
  const auto H = std::make_shared<const test::WaveField<Dim>>(4);
  const double gamma_0 = 0.7, gamma = -1.3;
  double errors[2];
  for (int finer = 0; finer < 2; ++finer) {
    const auto shape = test::sphere_geometry<Dim>((Dim == 2 ? 4 : 3) + finer);
    EnergySum<Dim> energy;
    add_minimal_surface<Dim>(energy, H, gamma_0, gamma, {.ray_spacing_mm = 0.05});
    energy.reset(shape);
    ShapeTerms<Dim> terms(shape);
    energy.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
    Samples<Dim> samples;
    H->sample(shape.points(), Derivatives::kFirst, samples);
    const Points<Dim> W = test::random_smooth_vectors<Dim>(shape.points(), 5);
    double discrete = 0, exact = 0;  // tested with the smooth normal velocity W . nu
    for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
      const Vector<Dim> nu = shape.points().row(i);  // of the unit sphere, where kappa = Dim - 1
      const double G = (gamma_0 * (Dim - 1) + gamma) * samples.value[i] +
                       gamma_0 * samples.gradient.row(i).dot(nu);
      const double V = W.row(i).dot(nu);
      discrete += terms.derivative.row(i).dot(shape.nodal_normals().row(i)) * V;
      exact += shape.lumped_mass()[i] * G * V;
    }
    errors[finer] = std::abs(discrete - exact) / std::abs(exact);
  }
  EXPECT_LT(errors[1], 0.3 * errors[0]);  // second order; pointwise it does not converge at
  EXPECT_LT(errors[1], 0.02);             // vertices of irregular valence
}

TYPED_TEST(EveryEnergy, ScalarProductWeightsAreThoseOfTheSecondDerivativeOnABall) {
  constexpr int Dim = TypeParam::value;
  // H = 1: alpha = gamma_0, beta = gamma kappa (not 2 gamma kappa, as printed in 5.1).
  const auto shape = test::sphere_geometry<Dim>(4);
  EnergySum<Dim> energy;
  add_minimal_surface<Dim>(energy, constant_field<Dim>(1), 0.7, 1.3, {});
  energy.reset(shape);
  ShapeTerms<Dim> terms(shape);
  energy.differentiate(test::unit_curvature<Dim>(shape.n_vertices()), 1, terms);
  EXPECT_NEAR(terms.alpha.minCoeff(), 0.7, 1e-12);
  EXPECT_NEAR(terms.alpha.maxCoeff(), 0.7, 1e-12);
  EXPECT_NEAR(terms.beta.minCoeff(), 1.3 * (Dim - 1), 1e-12);
  EXPECT_NEAR(terms.beta.maxCoeff(), 1.3 * (Dim - 1), 1e-12);
  EXPECT_NEAR(terms.g.maxCoeff(), 0.7, 1e-12);
}

// d2J of gamma |Omega| on a ball of radius r under uniform growth: d/dr of gamma |Gamma|.
TYPED_TEST(EveryEnergy, DomainTermOfTheSecondDerivativeIsKappaTimesHOnce) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(Dim == 2 ? 7 : 5);
  const auto area = [&](double r) { return fem::Geometry<Dim>(r * arrays.X, arrays.T).measure(); };
  const double second = (area(1.001) - area(0.999)) / 0.002;
  const double once = (Dim - 1) * area(1);  // int kappa H V W with V = W = 1
  EXPECT_NEAR(second, once, 1e-3 * once);
}

/// Root mean square of d2J(V, W) - difference quotient over several smooth shapes and normal
/// velocities, relative to that of d2J(V, W): on a single shape this may happen to vanish.
template <int Dim>
std::map<std::string, double> second_errors(int level) {
  constexpr double kStep = 2e-3;  // truncation ~ kStep^2
  std::map<std::string, double> errors, scales;
  for (int seed = 1; seed <= 5; ++seed) {
    const auto smooth = test::smooth_shape<Dim>(seed, level);
    const fem::Geometry<Dim> shape(smooth.X, smooth.T);
    const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
    const auto curvature = fem::curvature<Dim>(shape, A);
    const Eigen::VectorXd V = test::smooth_function<Dim>(smooth.X, 100 + seed);
    const Eigen::VectorXd W = test::smooth_function<Dim>(smooth.X, 200 + seed);
    for (auto& [name, energy] : all_energies<Dim>(seed, /*ray_spacing_mm=*/0.2)) {
      energy->reset(shape);
      SecondDerivative<Dim> second(shape);
      energy->differentiate_twice(curvature, 1, second);
      const double exact = V.dot(second.times(shape, A, W));
      const double difference = test::second_difference<Dim>(
          *energy, shape, V.asDiagonal() * smooth.normals, W.asDiagonal() * smooth.normals, kStep);
      errors[name] += std::pow(exact - difference, 2);
      scales[name] += std::pow(difference, 2);
    }
  }
  for (auto& [name, error] : errors) error = std::sqrt(error / scales[name]);
  return errors;
}

TYPED_TEST(EveryEnergy, SecondDerivativeErrorFallsWithTheSquareOfTheMeshSize) {
  constexpr int Dim = TypeParam::value;
  // 128 and 256 segments; 258 and 1026 vertices, where the terms of higher order still show.
  const int level = Dim == 2 ? 4 : 3;
  const double largest = Dim == 2 ? 5e-3 : 0.2, least_order = 1.5;
  auto coarse = second_errors<Dim>(level);
  for (const auto& [name, error] : second_errors<Dim>(level + 1)) {
    EXPECT_LT(error, largest) << name;
    EXPECT_GT(std::log2(coarse[name] / error), least_order) << name;
  }
}

TYPED_TEST(EveryEnergy, SecondDerivativeIsSymmetricAndProportionalToItsWeight) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(3);
  const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const auto curvature = fem::curvature<Dim>(shape, A);
  const Eigen::VectorXd V = test::smooth_function<Dim>(shape.points(), 1);
  const Eigen::VectorXd W = test::smooth_function<Dim>(shape.points(), 2);
  for (auto& [name, energy] : all_energies<Dim>(4)) {
    energy->reset(shape);
    SecondDerivative<Dim> once(shape), thrice(shape);
    energy->differentiate_twice(curvature, 1, once);
    energy->differentiate_twice(curvature, 3, thrice);
    const double VW = V.dot(once.times(shape, A, W)), WV = W.dot(once.times(shape, A, V));
    const double tolerance = 1e-12 * once.times(shape, A, W).cwiseAbs().sum();
    EXPECT_NEAR(VW, WV, tolerance) << name;
    EXPECT_NEAR(3 * VW, V.dot(thrice.times(shape, A, W)), 3 * tolerance) << name;
  }
}

}  // namespace
}  // namespace surf::energy
