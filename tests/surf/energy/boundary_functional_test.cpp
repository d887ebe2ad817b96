#include "libsurf/energy/boundary_functional.h"

#include "libsurf/fem/stiffness.h"
#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Functional);

template <int Dim>
fem::Curvature curvature_of(const fem::Geometry<Dim>& shape) {
  return fem::curvature<Dim>(shape,
                             fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())));
}

TYPED_TEST(Functional, AverageOfAConstantIsTheConstantWithoutDerivatives) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  BoundaryFunctional<Dim> J(average<Dim>(isotropic_density<Dim>(constant_field<Dim>(3))));
  J.reset(shape);
  EXPECT_NEAR(J.value(), 3, 1e-14);
  ShapeTerms<Dim> terms(shape);
  J.differentiate(curvature_of<Dim>(shape), 1, terms);
  EXPECT_LT(terms.derivative.cwiseAbs().maxCoeff(), 1e-14);
  SecondDerivative<Dim> second(shape);
  J.differentiate_twice(curvature_of<Dim>(shape), 1, second);
  const Eigen::VectorXd W = test::smooth_function<Dim>(shape.points(), 1);
  const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  EXPECT_LT(second.times(shape, A, W).cwiseAbs().maxCoeff(), 1e-12);
}

TYPED_TEST(Functional, AverageIsTheBoundaryIntegralOverTheMeasure) {
  constexpr int Dim = TypeParam::value;
  const auto H = std::make_shared<const test::WaveField<Dim>>(2);
  const auto shape = test::rough_geometry<Dim>(1);
  BoundaryFunctional<Dim> J(average<Dim>(isotropic_density<Dim>(H)));
  BoundaryIntegral<Dim> integral(H);
  J.reset(shape), integral.reset(shape);
  EXPECT_NEAR(J.value(), integral.value() / shape.measure(), 1e-14);
}

// Two integrals: the variance along the boundary is mean square minus squared mean, times |Gamma|.
TYPED_TEST(Functional, VarianceAgreesWithItsExpansion) {
  constexpr int Dim = TypeParam::value;
  const auto f = std::make_shared<const test::WaveField<Dim>>(2);
  const auto square = mapped_field<Dim>(f, [](double v) {
    return std::array<double, 3>{v * v, 2 * v, 2};
  });
  const auto shape = test::rough_geometry<Dim>(1);
  BoundaryFunctional<Dim> J(std::make_shared<const test::BoundaryVariance<Dim>>(f));
  BoundaryIntegral<Dim> mean(f), squares(square);
  J.reset(shape), mean.reset(shape), squares.reset(shape);
  EXPECT_NEAR(J.value(), squares.value() - mean.value() * mean.value() / shape.measure(), 1e-13);
}

/// H = int f - c on a shape where int f = c, so that H vanishes there and dH/dp does not.
template <int Dim>
class Excess : public DensityFamily<Dim> {
 public:
  using Pointer = DensityPointer<Dim>;
  Excess(std::shared_ptr<const Field<Dim>> f, Pointer own)
      : integrands_{isotropic_density<Dim>(std::move(f))}, own_(std::move(own)) {}
  const std::vector<Pointer>& integrands() const override { return integrands_; }
  Pointer at(const Eigen::VectorXd&) const override { return own_; }
  Pointer first(const Eigen::VectorXd&, int) const override {
    return isotropic_density<Dim>(constant_field<Dim>(1));
  }
  Pointer second(const Eigen::VectorXd&, int, int) const override { return nullptr; }

 private:
  std::vector<Pointer> integrands_;
  Pointer own_;
};

TYPED_TEST(Functional, ADensityThatIsNotThereCountsAsZero) {
  constexpr int Dim = TypeParam::value;
  const auto f = std::make_shared<const test::WaveField<Dim>>(2);
  const auto shape = test::rough_geometry<Dim>(1);
  const auto derivative = [&](DensityPointer<Dim> own) {
    BoundaryFunctional<Dim> J(std::make_shared<const Excess<Dim>>(f, std::move(own)));
    J.reset(shape);
    ShapeTerms<Dim> terms(shape);
    J.differentiate(curvature_of<Dim>(shape), 1, terms);
    return Points<Dim>(terms.derivative);
  };
  const Points<Dim> expected = derivative(isotropic_density<Dim>(constant_field<Dim>(0)));
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(derivative(nullptr), expected);
}

TYPED_TEST(Functional, HasTwoRankOneTermsPerIntegral) {
  constexpr int Dim = TypeParam::value;
  const auto f = std::make_shared<const test::WaveField<Dim>>(2);
  const auto shape = test::rough_geometry<Dim>(1);
  BoundaryFunctional<Dim> J(std::make_shared<const test::BoundaryVariance<Dim>>(f));
  J.reset(shape);
  SecondDerivative<Dim> second(shape);
  J.differentiate_twice(curvature_of<Dim>(shape), 1, second);
  EXPECT_EQ(second.vectors.cols(), 4);
  EXPECT_EQ(second.coefficients, second.coefficients.transpose());
}

}  // namespace
}  // namespace surf::energy
