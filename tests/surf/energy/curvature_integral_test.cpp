#include "libsurf/energy/curvature_integral.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

constexpr double kPi = std::numbers::pi;

template <int Dim>
CurvatureIntegral<Dim> willmore(double z_0 = 0) {
  return CurvatureIntegral<Dim>(squared_curvature<Dim>(constant_field<Dim>(1), z_0));
}

/// Everything about one shape.
template <int Dim>
struct Setting {
  Setting(const Points<Dim>& X, const Elements<Dim>& T)
      : shape(X, T),
        A(fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()))),
        curvature(fem::curvature<Dim>(shape, A)) {}

  Points<Dim> derivative(const ShapeEnergy<Dim>& J) const {
    ShapeTerms<Dim> terms(shape);
    J.differentiate(curvature, 1, terms);
    return terms.derivative;
  }
  double second(const ShapeEnergy<Dim>& J, const Eigen::VectorXd& V) const {
    SecondDerivative<Dim> d2J(shape);
    J.differentiate_twice(curvature, 1, d2J);
    return V.dot(d2J.times(shape, A, V));
  }

  fem::Geometry<Dim> shape;
  SparseMatrix A;
  fem::Curvature curvature;
};

IN_BOTH_DIMENSIONS(Willmore);

TYPED_TEST(Willmore, OfASphereConvergesToItsKnownValue) {
  constexpr int Dim = TypeParam::value;
  const double exact = Dim == 2 ? kPi : 8 * kPi;
  const auto error = [&](int level) {
    const auto arrays = test::unit_sphere<Dim>(level);
    auto J = willmore<Dim>();
    J.reset({arrays.X, arrays.T});
    return std::abs(J.value() - exact);
  };
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.2);
  EXPECT_LT(error(4), 0.02 * exact);
}

// Else the line where a border cuts a shape off would be pulled along the border.
TYPED_TEST(Willmore, DoesNotDependOnWhereVerticesOnABorderLie) {
  constexpr int Dim = TypeParam::value;
  constexpr double kPlane = 0.5;
  auto arrays = test::unit_sphere<Dim>(3);
  fem::Border<Dim> border{Points<Dim>::Identity(1, Dim), {}};
  for (Eigen::Index i = 0; i < arrays.X.rows(); ++i) {
    border.planes.push_back(arrays.X(i, 0) >= kPlane);
    arrays.X(i, 0) = std::min(arrays.X(i, 0), kPlane);
  }
  const fem::Geometry<Dim> shape(arrays.X, arrays.T, border);
  auto J = willmore<Dim>();
  J.reset(shape);
  EXPECT_GT(J.value(), 1);
  Points<Dim> flared = arrays.X;
  for (Eigen::Index i = 0; i < flared.rows(); ++i)
    if (border.planes[std::size_t(i)]) flared.row(i).template tail<Dim - 1>() *= 1.02;
  EXPECT_NEAR(J.try_move(shape.moved_to(flared)), J.value(), 1e-12 * J.value());
}

// int kappa^2 dS does not depend on the scale of a surface and falls as 1/r on curves.
TYPED_TEST(Willmore, ScalesAsItShouldToRounding) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::rough_sphere<Dim>(1);
  const Setting<Dim> at(arrays.X, arrays.T);
  auto J = willmore<Dim>();
  J.reset(at.shape);
  const double tolerance = 1e-12 * J.value();
  EXPECT_NEAR(at.derivative(J).cwiseProduct(arrays.X).sum(), (Dim - 3) * J.value(), tolerance);
}

TYPED_TEST(Willmore, WithTheSpheresOwnCurvatureVanishesWithItsDerivative) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(Dim == 2 ? 5 : 4);
  auto J = willmore<Dim>(Dim - 1);
  J.reset({arrays.X, arrays.T});
  EXPECT_LT(J.value(), 0.01 * kPi);
}

// On the unit circle the mode cos k t has the eigenvalue (k^2 - 1/2) (k^2 - 2), on the unit sphere
// a harmonic of degree l has (l - 1) l (l + 1) (l + 2).
TEST(WillmoreOfACircle, HasTheKnownSecondDerivative) {
  const auto arrays = test::unit_sphere<2>(7);
  const Setting<2> at(arrays.X, arrays.T);
  auto J = willmore<2>();
  J.reset(at.shape);
  for (const int k : {0, 1, 2, 3, 5}) {
    Eigen::VectorXd V(arrays.X.rows());
    for (Eigen::Index i = 0; i < V.size(); ++i)
      V[i] = std::cos(k * std::atan2(arrays.X(i, 1), arrays.X(i, 0)));
    const double norm = V.cwiseAbs2().dot(at.shape.lumped_mass());
    const double exact = (k * k - 0.5) * (k * k - 2);
    EXPECT_NEAR(at.second(J, V) / norm, exact, 1e-3 * (1 + std::abs(exact))) << k;
  }
}

TEST(WillmoreOfASphere, HasTheKnownSecondDerivative) {
  const auto arrays = test::unit_sphere<3>(5);
  const Setting<3> at(arrays.X, arrays.T);
  auto J = willmore<3>();
  J.reset(at.shape);
  const Eigen::ArrayXd x = arrays.X.col(0), y = arrays.X.col(1), z = arrays.X.col(2);
  const std::map<int, Eigen::VectorXd> harmonics = {
      {0, Eigen::ArrayXd::Ones(x.size())}, {1, z}, {2, x * y}, {3, x * y * z}};
  for (const auto& [l, V] : harmonics) {
    const double norm = V.cwiseAbs2().dot(at.shape.lumped_mass());
    const double exact = (l - 1) * l * (l + 1) * (l + 2);
    EXPECT_NEAR(at.second(J, V) / norm, exact, 0.02 * (1 + exact)) << l;
  }
}

// The torus of Clifford, R / r = sqrt 2, is critical and has 4 pi^2.
TEST(WillmoreOfATorus, IsCriticalAtCliffordsRatio) {
  const auto slope = [](double ratio, int n) {  // of J as R grows
    const auto arrays = test::torus(ratio, 1, n, n);
    const Setting<3> at(arrays.X, arrays.T);
    auto J = willmore<3>();
    J.reset(at.shape);
    Points<3> outward = arrays.X;
    outward.col(2).setZero();
    outward.rowwise().normalize();
    return std::pair(at.derivative(J).cwiseProduct(outward).sum(), J.value());
  };
  constexpr int kSegments = 96;
  const double critical = std::numbers::sqrt2;
  const auto [at, value] = slope(critical, kSegments);
  EXPECT_NEAR(value, 4 * kPi * kPi, 0.005 * value);
  EXPECT_LT(slope(critical - 0.1, kSegments).first, -10 * std::abs(at));
  EXPECT_GT(slope(critical + 0.1, kSegments).first, 10 * std::abs(at));
}

// The corrected Corollary 2.2.1 on a torus: G = -Lap kappa - kappa^3 / 2 + 2 kappa K.
TEST(WillmoreOfATorus, HasTheShapeGradientOfTheCorollaryWithTheMissingFactor) {
  const double R = 2, r = 1;
  constexpr int kSegments = 128;
  const auto arrays = test::torus(R, r, kSegments, kSegments);
  const Setting<3> at(arrays.X, arrays.T);
  auto J = willmore<3>();
  J.reset(at.shape);
  const Points<3> derivative = at.derivative(J);
  double discrete = 0, exact = 0, printed = 0;
  for (int i = 0; i < kSegments; ++i)
    for (int j = 0; j < kSegments; ++j) {
      const int at_vertex = i * kSegments + j;
      const double v = 2 * kPi * j / kSegments, c = std::cos(v), rho = R + r * c;
      const double kappa = 1 / r + c / rho, K = c / (r * rho);
      // kappa = 1/r + c/rho; Lap kappa = (1 / (r^2 rho)) d_v (rho d_v kappa)
      const double dv_rho_dv_kappa = -R * (c / rho + r * std::sin(v) * std::sin(v) / (rho * rho));
      const double laplacian = dv_rho_dv_kappa / (r * r * rho);
      const double V = std::cos(v);
      discrete += V * derivative.row(at_vertex).dot(at.shape.nodal_normals().row(at_vertex));
      const double w = V * at.shape.lumped_mass()[at_vertex];
      exact += w * (-laplacian - kappa * kappa * kappa / 2 + 2 * kappa * K);
      printed += w * (-laplacian - kappa * kappa * kappa / 2 + 2 * K);
    }
  EXPECT_NEAR(discrete, exact, 0.01 * std::abs(exact));
  EXPECT_GT(std::abs(discrete - printed), 0.05 * std::abs(exact));
}

}  // namespace
}  // namespace surf::energy
