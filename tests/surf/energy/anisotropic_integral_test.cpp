#include "libsurf/energy/anisotropic_integral.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"
#include "tests/surf/energy/same_terms.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Anisotropic);

// A linear map B takes the area element to |det B| |B^-T nu| dS: exact on any polyhedron.
TYPED_TEST(Anisotropic, NormOfALinearMapIsTheMeasureOfTheMappedShapeExactly) {
  constexpr int Dim = TypeParam::value;
  Eigen::Matrix<double, Dim, Dim> B = Eigen::Matrix<double, Dim, Dim>::Identity();
  B(0, 0) = 1.7;
  B(0, 1) = 0.4;
  const Eigen::Matrix<double, Dim, Dim> M =
      B.determinant() * B.determinant() * (B.transpose() * B).inverse();
  const auto arrays = test::rough_sphere<Dim>(2);
  // |B^-T nu|^2 = nu . B^-1 B^-T nu = nu . (B^T B)^-1 nu
  AnisotropicIntegral<Dim> J(norm_density<Dim>(constant_field<Dim>(1), M));
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  J.reset(shape);
  const fem::Geometry<Dim> mapped(arrays.X * B.transpose(), arrays.T);
  EXPECT_NEAR(J.value(), mapped.measure(), 1e-13 * mapped.measure());
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
  const Points<Dim> expected =
      fem::stiffness<Dim>(mapped, Eigen::VectorXd::Ones(mapped.n_elements())) * mapped.points() * B;
  EXPECT_LT((terms.derivative - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TYPED_TEST(Anisotropic, WithoutDependenceOnTheNormalIsTheBoundaryIntegral) {
  constexpr int Dim = TypeParam::value;
  const auto H = std::make_shared<const test::WaveField<Dim>>(1);
  const auto shape = test::rough_geometry<Dim>(1);
  const auto kappa = fem::curvature<Dim>(
      shape, fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())));
  AnisotropicIntegral<Dim> J(isotropic_density<Dim>(H));
  BoundaryIntegral<Dim> expected(H);
  test::expect_same_terms<Dim>(J, expected, shape, kappa,
                               {.value = 1e-13, .first = 1e-13, .beta = 1e-11});
  SecondDerivative<Dim> c(shape), d(shape);
  J.differentiate_twice(kappa, 2, c), expected.differentiate_twice(kappa, 2, d);
  EXPECT_LT((c.sparse - d.sparse).norm(), 1e-12 * d.sparse.norm());
}

/// sqrt(y . M y) / |y|: the same as norm_density at unit normals.
template <int Dim>
class OtherContinuation : public AnisotropicDensity<Dim> {
 public:
  explicit OtherContinuation(const Vector<Dim>& diagonal) : M_(diagonal.asDiagonal()) {}
  void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
              DensitySamples<Dim>& out) const override {
    using Matrix = Eigen::Matrix<double, Dim, Dim, Eigen::RowMajor>;
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<Dim> nu = y.row(i);  // |nu| = 1
      const Vector<Dim> slope = M_ * nu / std::sqrt(nu.dot(M_ * nu));
      const double H = slope.dot(nu);
      out.value[i] = H;
      if (order == Derivatives::kNone) continue;
      out.dy.row(i) = slope - H * nu;
      if (order == Derivatives::kFirst) continue;
      const Matrix one = Matrix::Identity();
      Eigen::Map<Matrix>(out.dyy.row(i).data()) = (M_ - slope * slope.transpose()) / H -
                                                  slope * nu.transpose() - nu * slope.transpose() +
                                                  3 * H * nu * nu.transpose() - H * one;
    }
  }

 private:
  Eigen::Matrix<double, Dim, Dim> M_;
};

TYPED_TEST(Anisotropic, DerivativesDoNotDependOnTheContinuationOffUnitNormals) {
  constexpr int Dim = TypeParam::value;
  const Vector<Dim> diagonal = Vector<Dim>::LinSpaced(0.5, 2);
  const auto smooth = test::smooth_shape<Dim>(1, 3);
  const fem::Geometry<Dim> shape(smooth.X, smooth.T);
  const auto kappa = fem::curvature<Dim>(
      shape, fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())));
  AnisotropicIntegral<Dim> one(norm_density<Dim>(constant_field<Dim>(1), diagonal.asDiagonal()));
  AnisotropicIntegral<Dim> other(std::make_shared<const OtherContinuation<Dim>>(diagonal));
  one.reset(shape), other.reset(shape);
  ShapeTerms<Dim> a(shape), b(shape);
  one.differentiate(kappa, 1, a), other.differentiate(kappa, 1, b);
  EXPECT_LT((a.derivative - b.derivative).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((a.alpha - b.alpha).cwiseAbs().maxCoeff(), 1e-12);
  SecondDerivative<Dim> c(shape), d(shape);
  one.differentiate_twice(kappa, 1, c), other.differentiate_twice(kappa, 1, d);
  EXPECT_LT((c.sparse - d.sparse).norm(), 1e-12 * c.sparse.norm());
}

// int <grad I, nu> dS = int_Omega Lap I dx: 2 Dim |Omega| for I = |x|^2, and so is its derivative.
TYPED_TEST(Anisotropic, SignedAlignmentIsTheIntegralOfTheLaplacian) {
  constexpr int Dim = TypeParam::value;
  class Square : public Field<Dim> {
   public:
    void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
      out.resize(x.rows(), order);
      out.value = x.rowwise().squaredNorm();
      if (order >= Derivatives::kFirst) out.gradient = 2 * x;
      out.hessian.setZero();
      if (order < Derivatives::kSecond) return;
      for (int axis = 0; axis < Dim; ++axis) out.hessian.col(axis * (Dim + 1)).setConstant(2);
    }
  };
  const auto shape = test::rough_geometry<Dim>(4);
  AnisotropicIntegral<Dim> J(alignment_density<Dim>(std::make_shared<const Square>(),
                                                    signed_alignment(1, 1), /*step_mm=*/0.01));
  J.reset(shape);
  EXPECT_NEAR(J.value(), 2 * Dim * shape.enclosed(), 1e-12);
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
  const Points<Dim> expected =
      2.0 * Dim * (shape.lumped_mass().asDiagonal() * shape.nodal_normals());
  EXPECT_LT((terms.derivative - expected).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace surf::energy
