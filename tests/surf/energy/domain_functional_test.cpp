#include "libsurf/energy/domain_functional.h"

#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(DomainWithIntegrals);

/// (1 + p_1) f with p_1 = |Omega|: J = (1 + |Omega|) int f.
template <int Dim>
class Product : public FieldFamily<Dim> {
 public:
  using Pointer = typename FieldFamily<Dim>::Pointer;
  explicit Product(Pointer f) : f_(std::move(f)), integrands_{constant_field<Dim>(1)} {}
  const std::vector<Pointer>& integrands() const override { return integrands_; }
  Pointer at(const Eigen::VectorXd& p) const override {
    return mapped_field<Dim>(f_, [c = 1 + p[0]](double v) {
      return std::array<double, 3>{c * v, c, 0};
    });
  }
  Pointer first(const Eigen::VectorXd&, int) const override { return f_; }
  Pointer second(const Eigen::VectorXd&, int, int) const override { return nullptr; }

 private:
  Pointer f_;
  std::vector<Pointer> integrands_;
};

TYPED_TEST(DomainWithIntegrals, IsTheProductThatItsDensityStatesWithVanishingSecondDerivative) {
  constexpr int Dim = TypeParam::value;
  const auto f = std::make_shared<const test::WaveField<Dim>>(1);
  const auto shape = test::smooth_geometry<Dim>(1, 3);
  const DomainIntegralOptions options{.ray_spacing_mm = 0.05};
  DomainFunctional<Dim> J(std::make_shared<const Product<Dim>>(f), options);
  DomainIntegral<Dim> integral(f, options);
  J.reset(shape), integral.reset(shape);
  EXPECT_NEAR(J.value(), (1 + shape.enclosed()) * integral.value(), 1e-12);
  SecondDerivative<Dim> second(shape);
  J.differentiate_twice(test::no_curvature(shape.n_vertices()), 2, second);
  ASSERT_EQ(second.vectors.cols(), 2);
  EXPECT_EQ(second.coefficients(0, 0), 0);
  EXPECT_EQ(second.coefficients(0, 1), 2);
}

TYPED_TEST(DomainWithIntegrals, KeepsItsValueWhenTheMeshChanges) {
  constexpr int Dim = TypeParam::value;
  const auto coarse = test::unit_sphere<Dim>(2), fine = test::unit_sphere<Dim>(3);
  const auto f = std::make_shared<const test::WaveField<Dim>>(1);
  DomainFunctional<Dim> J(std::make_shared<const test::InnerVariance<Dim>>(f),
                          {.ray_spacing_mm = 0.05});
  J.reset({coarse.X, coarse.T});
  const double before = J.value();
  const fem::Geometry<Dim> shape(fine.X, fine.T);
  J.remesh(shape);
  EXPECT_EQ(J.value(), before);
  EXPECT_NEAR(J.try_move(shape), before, 1e-15);
}

}  // namespace
}  // namespace surf::energy
