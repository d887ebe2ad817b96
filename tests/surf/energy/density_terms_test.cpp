#include "libsurf/energy/detail/density_terms.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

constexpr int kOrder = 4;

template <int Dim>
test::UserDensity<Dim> some_density() {
  return test::UserDensity<Dim>(std::make_shared<const test::WaveField<Dim>>(4));
}

template <int Dim>
DensityPointer<Dim> one() {
  return isotropic_density<Dim>(constant_field<Dim>(1));
}

template <int Dim>
double integral(const AnisotropicDensity<Dim>& H, const fem::Geometry<Dim>& shape) {
  return boundary_sum<Dim>(sample_boundary<Dim>(H, shape, kOrder, Derivatives::kNone).value, shape,
                           kOrder);
}

IN_BOTH_DIMENSIONS(DensityTerms);

TYPED_TEST(DensityTerms, SumsOneToTheMeasure) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(2);
  EXPECT_NEAR(integral<Dim>(*one<Dim>(), shape), shape.measures().sum(), 1e-13);
}

// int nu dS = 0 on every closed shape.
TYPED_TEST(DensityTerms, SumsNormalsToZero) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(2);
  const auto samples = sample_boundary<Dim>(some_density<Dim>(), shape, kOrder, Derivatives::kNone);
  const Eigen::Index n_points = samples.value.size() / shape.n_elements();
  for (int axis = 0; axis < Dim; ++axis) {
    Eigen::VectorXd nu(samples.value.size());
    for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
      nu.segment(t * n_points, n_points).setConstant(shape.normals()(t, axis));
    EXPECT_NEAR(boundary_sum<Dim>(nu, shape, kOrder), 0, 1e-13);
  }
}

TYPED_TEST(DensityTerms, DerivativeIsThatOfTheSum) {
  constexpr int Dim = TypeParam::value;
  const auto H = some_density<Dim>();
  const auto shape = test::rough_geometry<Dim>(3, Dim == 2 ? 2 : 1);
  const auto samples = sample_boundary<Dim>(H, shape, kOrder, Derivatives::kFirst);
  test::expect_gradient<Dim>(
      boundary_derivative<Dim>(samples, shape, kOrder), shape,
      [&](const fem::Geometry<Dim>& moved) { return integral<Dim>(H, moved); },
      /*step=*/1e-5, /*tolerance=*/1e-8);
}

TYPED_TEST(DensityTerms, DerivativeOfTheMeasureIsTheStiffnessTimesPositions) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5);
  const auto samples = sample_boundary<Dim>(*one<Dim>(), shape, kOrder, Derivatives::kFirst);
  const Points<Dim> expected = fem::stiffness<Dim>(shape) * shape.points();
  EXPECT_LT((boundary_derivative<Dim>(samples, shape, kOrder) - expected).cwiseAbs().maxCoeff(),
            1e-12);
}

TYPED_TEST(DensityTerms, LoadIsTheDerivativeAlongTheDirections) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(6);
  const auto samples =
      sample_boundary<Dim>(some_density<Dim>(), shape, kOrder, Derivatives::kFirst);
  const Points<Dim> derivative = boundary_derivative<Dim>(samples, shape, kOrder);
  const Eigen::VectorXd load = boundary_load<Dim>(samples, shape, kOrder);
  for (Eigen::Index i = 0; i < load.size(); ++i)
    EXPECT_NEAR(load[i], derivative.row(i).dot(shape.directions().row(i)), 1e-13);
}

// H = 1: the scalar product of the area, <grad V, grad W>, and g = 1.
TYPED_TEST(DensityTerms, OfTheMeasureAreThoseOfItsScalarProduct) {
  constexpr int Dim = TypeParam::value;
  constexpr double kWeight = 3;
  const auto shape = test::rough_geometry<Dim>(7);
  const auto samples = sample_boundary<Dim>(*one<Dim>(), shape, kOrder, Derivatives::kSecond);
  ShapeTerms<Dim> terms(shape);
  add_boundary_terms<Dim>(samples, shape, kOrder, Eigen::VectorXd::Zero(shape.n_vertices()),
                          kWeight, terms);
  EXPECT_NEAR((terms.alpha.array() - kWeight).abs().maxCoeff(), 0, 1e-13);
  EXPECT_NEAR((terms.g.array() - kWeight).abs().maxCoeff(), 0, 1e-13);
  EXPECT_EQ(terms.beta.cwiseAbs().maxCoeff(), 0);
  // Added to what is there.
  const ShapeTerms<Dim> before = terms;
  add_boundary_terms<Dim>(samples, shape, kOrder, Eigen::VectorXd::Zero(shape.n_vertices()), 1,
                          terms);
  EXPECT_NEAR((terms.g - before.g * 4 / kWeight).cwiseAbs().maxCoeff(), 0, 1e-13);
}

// H = |x|^2 on the unit sphere: g = 1, alpha = 1, beta = d_nunu H + 2 kappa d_nu H = 2 + 4 (Dim-1).
TYPED_TEST(DensityTerms, OfAFieldOnASphereConverge) {
  constexpr int Dim = TypeParam::value;
  class Square : public Field<Dim> {
    void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
      out.resize(x.rows(), order);
      out.value = x.rowwise().squaredNorm();
      out.gradient = 2 * x.topRows(out.gradient.rows());
      const Eigen::Matrix<double, Dim, Dim> two = 2 * Eigen::Matrix<double, Dim, Dim>::Identity();
      for (Eigen::Index i = 0; i < out.hessian.rows(); ++i)
        out.hessian.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, Dim * Dim>>(two.data());
    }
  };
  const auto H = isotropic_density<Dim>(std::make_shared<const Square>());
  const auto error = [&](int level) {
    const auto shape = test::sphere_geometry<Dim>(level);
    const auto samples = sample_boundary<Dim>(*H, shape, kOrder, Derivatives::kSecond);
    ShapeTerms<Dim> terms(shape);
    add_boundary_terms<Dim>(samples, shape, kOrder,
                            Eigen::VectorXd::Constant(shape.n_vertices(), Dim - 1), 1, terms);
    return std::max({(terms.g.array() - 1).abs().maxCoeff(),
                     (terms.alpha.array() - 1).abs().maxCoeff(),
                     (terms.beta.array() - 2 - 4 * (Dim - 1)).abs().maxCoeff()});
  };
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.3);
}

// H = 1: d2J(V, W) = <grad V, grad W> + <2 kappa_1 kappa_2 V, W>; for V = W = 1 on the unit sphere
// ((Dim - 1)^2 - (Dim - 1)) |Gamma|.
TYPED_TEST(DensityTerms, SecondDerivativeOfTheMeasureHoldsGaussCurvature) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(2);
  const auto samples = sample_boundary<Dim>(*one<Dim>(), shape, kOrder, Derivatives::kSecond);
  SecondDerivative<Dim> second(shape);
  add_boundary_second<Dim>(samples, shape, kOrder, test::unit_curvature<Dim>(shape.n_vertices()), 1,
                           second.sparse);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(shape.n_vertices());
  EXPECT_NEAR(ones.dot(second.sparse * ones), (Dim - 1) * (Dim - 2) * shape.measures().sum(),
              1e-12);
  const Eigen::MatrixXd S = second.sparse;
  EXPECT_LT((S - S.transpose()).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace surf::energy
