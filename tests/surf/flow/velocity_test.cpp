#include "libsurf/flow/velocity.h"

#include "libsurf/base/log.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/content.h"
#include "tests/surf/flow/stepping.h"

namespace surf::flow {
namespace {

using test::DimName;
using test::Dims;

template <class T>
struct VelocityOf : ::testing::Test {};
TYPED_TEST_SUITE(VelocityOf, Dims, DimName);

constexpr std::array kProducts = {ScalarProduct::kL2, ScalarProduct::kH1};
constexpr std::array kSchemes = {Scheme::kExplicit, Scheme::kSemiImplicit};

/// (5.1) with gamma_0 = 0.7, gamma = -1.3 and a field of plane waves.
template <int Dim>
energy::EnergySum<Dim> minimal_surface(std::shared_ptr<const Field<Dim>> H, double gamma_0 = 0.7,
                                       double gamma = -1.3) {
  energy::EnergySum<Dim> J;
  energy::add_minimal_surface<Dim>(J, std::move(H), gamma_0, gamma, {.ray_spacing_mm = 0.1});
  return J;
}

/// x -> H((x - shift) / scale), with its derivatives.
template <int Dim>
class Transplanted : public Field<Dim> {
 public:
  Transplanted(std::shared_ptr<const Field<Dim>> H, const Vector<Dim>& shift, double scale)
      : H_(std::move(H)), shift_(shift), scale_(scale) {}
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    const Points<Dim> inner = (x.rowwise() - shift_.transpose()) / scale_;
    H_->sample(inner, order, out);
    out.gradient /= scale_;
    out.hessian /= scale_ * scale_;
  }

 private:
  std::shared_ptr<const Field<Dim>> H_;
  Vector<Dim> shift_;
  double scale_;
};

// With b(V, .) = -dJ(.) the decrease along V is b(V, V).
TYPED_TEST(VelocityOf, OfTheExplicitSchemesDescendsByItsOwnSquaredNorm) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(2, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(1));
  for (const ScalarProduct product : kProducts) {
    const VelocityOptions options{.product = product, .solver_tolerance = 1e-12};
    const test::Direction<Dim> direction(shape, J, options);
    const auto velocity = direction.system.solve(0);
    EXPECT_FALSE(direction.system.depends_on_step());
    EXPECT_LT(velocity.shape_derivative, 0);
    EXPECT_NEAR(velocity.shape_derivative, -velocity.norm_squared, 1e-10 * velocity.norm_squared);
  }
}

TYPED_TEST(VelocityOf, OfEverySchemeHasTheShapeDerivativeOfItsVector) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(3, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(2));
  for (const ScalarProduct product : kProducts)
    for (const Scheme scheme : kSchemes) {
      const test::Direction<Dim> direction(shape, J, {.product = product, .scheme = scheme});
      const auto velocity = direction.system.solve(0.01);
      const double expected = direction.terms.derivative.cwiseProduct(velocity.vector).sum();
      EXPECT_LT(velocity.shape_derivative, 0);
      EXPECT_NEAR(velocity.shape_derivative, expected, 1e-12 * std::abs(expected));
    }
}

// The H1 system written out: (A_alpha + M_beta) V = -dJ.n with beta >= 100 g_max / r^2.
TYPED_TEST(VelocityOf, OfExplicitH1SolvesTheWeightedSystemWithItsFloor) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(4, 2);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(3));
  const test::Direction<Dim> direction(shape, J, {.solver_tolerance = 1e-13});
  const auto& terms = direction.terms;
  const double r = shape.radius();
  const Eigen::VectorXd beta = terms.beta.cwiseMax(100 * terms.g.maxCoeff() / (r * r));
  Eigen::MatrixXd B = fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0)).toDense();
  B.diagonal() += shape.lumped_mass().cwiseProduct(beta);
  const Eigen::VectorXd load =
      -terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
  const Eigen::VectorXd V = B.ldlt().solve(load);
  EXPECT_LT((direction.system.solve(0).normal - V).norm(), 1e-10 * V.norm());
}

// (tau W S + M) V = -dJ.n, W = M_g M^-1: the unsymmetric form of what is solved for L2, and with
// the H1 product in place of M.
TYPED_TEST(VelocityOf, OfTheSemiImplicitSchemeSolvesTheSchurComplement) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(5, 2);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(4));
  constexpr double kTau = 0.02;
  for (const ScalarProduct product : kProducts) {
    const test::Direction<Dim> direction(
        shape, J, {.product = product, .scheme = Scheme::kSemiImplicit, .solver_tolerance = 1e-13});
    const auto& terms = direction.terms;
    const double r = shape.radius();
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(shape.n_vertices(), shape.n_vertices());
    Eigen::VectorXd beta = Eigen::VectorXd::Ones(shape.n_vertices());
    if (product == ScalarProduct::kH1) {
      B = fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0)).toDense();
      beta = terms.beta.cwiseMax(100 * terms.g.maxCoeff() / (r * r));
    }
    B.diagonal() += shape.lumped_mass().cwiseProduct(beta);
    B += kTau * (terms.g.asDiagonal() * fem::normal_stiffness<Dim>(shape, direction.A).toDense());
    const Eigen::VectorXd load =
        -terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const Eigen::VectorXd V = B.partialPivLu().solve(load);
    EXPECT_TRUE(direction.system.depends_on_step());
    EXPECT_LT((direction.system.solve(kTau).normal - V).norm(), 1e-9 * V.norm());
  }
}

TYPED_TEST(VelocityOf, OfTheSemiImplicitSchemeIsTheExplicitOneAtStepZero) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(6, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(5));
  for (const ScalarProduct product : kProducts) {
    const auto normal = [&](Scheme scheme) {
      const test::Direction<Dim> direction(
          shape, J, {.product = product, .scheme = scheme, .solver_tolerance = 1e-12});
      return direction.system.solve(0).normal;
    };
    const Eigen::VectorXd explicitly = normal(Scheme::kExplicit);
    EXPECT_LT((normal(Scheme::kSemiImplicit) - explicitly).norm(), 1e-9 * explicitly.norm());
  }
}

// gamma_0 is dimensionless, gamma is 1/length: with x -> s x + c and gamma -> gamma / s the area
// part scales as s^(Dim-1). Then V_L2 scales as 1/s and the H1 step, an inexact Newton step, as s.
TYPED_TEST(VelocityOf, IsUnchangedByTranslationAndScalesWithTheUnitOfLength) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(7, Dim == 2 ? 3 : 2);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  const auto H = std::make_shared<const test::WaveField<Dim>>(6);
  const Vector<Dim> shift = Vector<Dim>::LinSpaced(3, -8);
  constexpr double kTau = 0.01;
  for (const double s : {1e-3, 1.0, 1e3})
    for (const ScalarProduct product : kProducts)
      for (const Scheme scheme : kSchemes) {
        const VelocityOptions options{
            .product = product, .scheme = scheme, .solver_tolerance = 1e-13};
        auto J = minimal_surface<Dim>(H);
        const test::Direction<Dim> direction(shape, J, options);
        const Points<Dim> X = (s * arrays.X).rowwise() + (s * shift).transpose();
        const fem::Geometry<Dim> other(X, arrays.T);
        auto J_other = minimal_surface<Dim>(
            std::make_shared<const Transplanted<Dim>>(H, s * shift, s), 0.7, -1.3 / s);
        const test::Direction<Dim> other_direction(other, J_other, options);
        const bool is_l2 = product == ScalarProduct::kL2;
        const Eigen::VectorXd V = direction.system.solve(kTau).normal;
        // tau V is a length: tau scales as s^2 for L2, not at all for H1.
        const Eigen::VectorXd V_other =
            other_direction.system.solve(is_l2 ? s * s * kTau : kTau).normal;
        const double factor = is_l2 ? 1 / s : s;
        EXPECT_LT((V_other / factor - V).norm(), 1e-8 * V.norm())
            << "scale " << s << (is_l2 ? " L2" : " H1");
      }
}

// Intensities do not enter the H1 direction: alpha, beta and dJ all scale with the energy.
TYPED_TEST(VelocityOf, OfTheH1FlowIsUnchangedWhenTheEnergyIsScaled) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(8, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  const auto H = std::make_shared<const test::WaveField<Dim>>(7);
  const auto normal = [&](double factor) {
    auto J = minimal_surface<Dim>(H, 0.7 * factor, -1.3 * factor);
    const test::Direction<Dim> direction(shape, J, {.solver_tolerance = 1e-12});
    return direction.system.solve(0).normal;
  };
  const Eigen::VectorXd V = normal(1);
  EXPECT_LT((normal(1e8) - V).norm(), 1e-9 * V.norm());
  EXPECT_LT((normal(1e-8) - V).norm(), 1e-9 * V.norm());
}

// (M A^+ M) V = -r: minus the gradient in H^-1, so dJ(V) = -b(V, V); and the content stands.
TYPED_TEST(VelocityOf, OfTheHMinus1FlowDescendsByItsSquaredNormAndKeepsTheContent) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(9, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(8));
  const test::Direction<Dim> direction(shape, J, {.product = ScalarProduct::kHMinus1});
  const auto velocity = direction.system.solve(0);
  EXPECT_LT(velocity.shape_derivative, 0);
  EXPECT_NEAR(velocity.shape_derivative, -velocity.norm_squared, 1e-12 * velocity.norm_squared);
  const Eigen::VectorXd change =
      content_gradient<Dim>(arrays.X, arrays.T).cwiseProduct(velocity.vector).rowwise().sum();
  EXPECT_LT(std::abs(change.sum()), 1e-12 * change.cwiseAbs().sum());
}

TYPED_TEST(VelocityOf, OfTheSemiImplicitHMinus1FlowSolvesTheMixedSystem) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(10, 2);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(9));
  const test::Direction<Dim> direction(
      shape, J, {.product = ScalarProduct::kHMinus1, .scheme = Scheme::kSemiImplicit});
  const auto& terms = direction.terms;
  const Eigen::Index n = shape.n_vertices();
  const Eigen::VectorXd m =
      shape.lumped_mass().cwiseProduct(shape.nodal_normals().rowwise().squaredNorm());
  const Eigen::MatrixXd a =
      fem::normal_stiffness<Dim>(shape, fem::stiffness<Dim>(shape, terms.alpha)).toDense();
  for (const double tau : {1e-4, 1e-2, 1.0}) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    matrix.topLeftCorner(n, n) = tau * a;
    matrix.topRightCorner(n, n) = m.asDiagonal();
    matrix.bottomLeftCorner(n, n) = m.asDiagonal();
    matrix.bottomRightCorner(n, n) = -direction.A.toDense();
    Eigen::VectorXd load = Eigen::VectorXd::Zero(2 * n);
    load.head(n) = -terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const Eigen::VectorXd V = matrix.partialPivLu().solve(load).head(n);
    EXPECT_TRUE(direction.system.depends_on_step());
    const auto velocity = direction.system.solve(tau);
    EXPECT_LT((velocity.normal - V).norm(), 1e-8 * V.norm()) << tau;
    EXPECT_LT(velocity.shape_derivative, 0);
    EXPECT_LT(std::abs(m.dot(velocity.normal)), 1e-12 * m.dot(velocity.normal.cwiseAbs()));
  }
}

/// x^2 - y^2: an eigenfunction on the unit circle (2^2) and sphere (2 * 3) of -Lap.
template <int Dim>
Eigen::VectorXd mode(const Points<Dim>& X) {
  return X.col(0).array().square() - X.col(1).array().square();
}

// r = 1 + eps Y with -Lap Y = l Y has kappa = Dim - 1 + eps (l - Dim + 1) Y + O(eps^2); so Lap
// kappa = -l (l - Dim + 1) eps Y.
TYPED_TEST(VelocityOf, OfSurfaceDiffusionConvergesToTheLaplacianOfTheCurvature) {
  constexpr int Dim = TypeParam::value;
  constexpr double kEps = 1e-3;
  const double l = Dim == 2 ? 4 : 6, exact = -l * (l - Dim + 1) * kEps;
  double before = 0;
  for (int level = 3; level < 6; ++level) {
    auto arrays = test::unit_sphere<Dim>(level);
    const Eigen::VectorXd Y = mode<Dim>(arrays.X);
    arrays.X = ((kEps * Y).array() + 1).matrix().asDiagonal() * arrays.X;
    const fem::Geometry<Dim> shape(arrays.X, arrays.T);
    auto J = test::area_energy<Dim>();
    const test::Direction<Dim> direction(shape, J, {.product = ScalarProduct::kHMinus1});
    const Eigen::VectorXd mass_Y = shape.lumped_mass().cwiseProduct(Y);
    const double measured = direction.system.solve(0).normal.dot(mass_Y) / Y.dot(mass_Y);
    const double error = std::abs(measured / exact - 1);
    if (level == 5) {
      EXPECT_LT(error, 0.01);
      EXPECT_GT(before / error, 1.5);
    }
    before = error;
  }
}

// B V + lambda q = -r, q^T V = 0.
TYPED_TEST(VelocityOf, ThatKeepsTheContentSolvesTheSystemWithItsMultiplier) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(11, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  auto J = minimal_surface<Dim>(std::make_shared<const test::WaveField<Dim>>(10));
  const Eigen::VectorXd q =
      content_gradient<Dim>(arrays.X, arrays.T).cwiseProduct(shape.nodal_normals()).rowwise().sum();
  for (const ScalarProduct product : kProducts) {
    const VelocityOptions options{
        .product = product, .solver_tolerance = 1e-13, .keeps_content = true};
    const test::Direction<Dim> direction(shape, J, options);
    const auto velocity = direction.system.solve(0);
    EXPECT_LT(std::abs(q.dot(velocity.normal)), 1e-12 * q.dot(velocity.normal.cwiseAbs()));
    EXPECT_NEAR(velocity.shape_derivative, -velocity.norm_squared, 1e-10 * velocity.norm_squared);
    VelocityOptions free = options;
    free.keeps_content = false;
    const Eigen::VectorXd unconstrained =
        test::Direction<Dim>(shape, J, free).system.solve(0).normal;
    EXPECT_LT(
        (velocity.normal + velocity.multiplier * velocity.content_direction - unconstrained).norm(),
        1e-12 * unconstrained.norm());
  }
}

TYPED_TEST(VelocityOf, OfTheSemiImplicitSchemeIsTheExplicitOneWithoutACurvatureTerm) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(12, 3);
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  energy::DomainIntegral<Dim> J(std::make_shared<const test::WaveField<Dim>>(11),
                                {.ray_spacing_mm = 0.1});
  for (const ScalarProduct product :
       {ScalarProduct::kL2, ScalarProduct::kH1, ScalarProduct::kHMinus1}) {
    const auto normal = [&](Scheme scheme) {
      const test::Direction<Dim> direction(
          shape, J, {.product = product, .scheme = scheme, .solver_tolerance = 1e-12});
      return direction.system.solve(0.3).normal;
    };
    const Eigen::VectorXd explicitly = normal(Scheme::kExplicit);
    ASSERT_TRUE(explicitly.allFinite());
    EXPECT_EQ(normal(Scheme::kSemiImplicit), explicitly);
  }
}

TEST(VelocityOptions, NameTheFieldThatIsWrong) {
  EXPECT_EQ(VelocityOptions{}.error(), "");
  EXPECT_EQ(VelocityOptions{.beta_floor = 0}.error(),
            "VelocityOptions::beta_floor = 0 violates > 0");
  EXPECT_EQ(VelocityOptions{.solver_tolerance = 1}.error(),
            "VelocityOptions::solver_tolerance = 1 violates 0 < tolerance < 1");
}

TEST(Velocity, SaysThatItsSolverDidNotConverge) {
  const auto arrays = test::unit_sphere<3>(2);
  const fem::Geometry<3> shape(arrays.X, arrays.T);
  energy::ShapeTerms<3> terms(shape);
  terms.derivative.col(0) = arrays.X.col(1);
  terms.alpha.setOnes();
  terms.beta.setOnes();
  const SparseMatrix A = fem::stiffness<3>(shape);
  VelocityOptions options;
  std::vector<std::string> messages;
  set_log_sink([&](LogLevel, const std::string& message) { messages.push_back(message); });
  VelocitySystem<3>(shape, terms, A, options).solve(0);
  EXPECT_TRUE(messages.empty());
  options.solver_tolerance = 1e-300;
  VelocitySystem<3>(shape, terms, A, options).solve(0);
  set_log_sink({});
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_NE(messages[0].find("the residual is"), std::string::npos) << messages[0];
}

}  // namespace
}  // namespace surf::flow
