#include "libsurf/energy/energy_sum.h"

#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Sum);

TYPED_TEST(Sum, IsTheWeightedSumOfItsTermsAtEveryCall) {
  constexpr int Dim = TypeParam::value;
  const auto H = std::make_shared<const test::WaveField<Dim>>(1);
  const auto shape = test::rough_geometry<Dim>(1);
  const auto moved = shape.moved_to(1.05 * shape.points());
  EnergySum<Dim> sum;
  add_minimal_surface<Dim>(sum, H, 0.7, -1.3, {});
  BoundaryIntegral<Dim> boundary(H);
  DomainIntegral<Dim> domain(H, {});
  const auto expect_sum = [&](double value, double a, double b) {
    EXPECT_NEAR(value, 0.7 * a - 1.3 * b, 1e-13);
  };
  sum.reset(shape), boundary.reset(shape), domain.reset(shape);
  expect_sum(sum.value(), boundary.value(), domain.value());
  const auto kappa = test::unit_curvature<Dim>(shape.n_vertices());
  ShapeTerms<Dim> all(shape), a(shape), b(shape);
  sum.differentiate(kappa, 2, all);
  boundary.differentiate(kappa, 2 * 0.7, a);
  domain.differentiate(kappa, -2 * 1.3, b);
  EXPECT_LT((all.derivative - a.derivative - b.derivative).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((all.beta - a.beta - b.beta).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((all.g - a.g).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((all.alpha - a.alpha).cwiseAbs().maxCoeff(), 1e-13);
  expect_sum(sum.try_move(moved), boundary.try_move(moved), domain.try_move(moved));
  sum.accept(), boundary.accept(), domain.accept();
  expect_sum(sum.value(), boundary.value(), domain.value());
  sum.remesh(shape), boundary.remesh(shape), domain.remesh(shape);
  expect_sum(sum.value(), boundary.value(), domain.value());
}

TYPED_TEST(Sum, LeavesOutTermsOfWeightZeroAndNamesTheOthers) {
  constexpr int Dim = TypeParam::value;
  EnergySum<Dim> sum;
  EXPECT_EQ(sum.value(), 0);
  add_minimal_surface<Dim>(sum, constant_field<Dim>(1), 1, 0, {});
  EXPECT_EQ(sum.name(), "boundary-integral");
  sum.add(2,
          std::make_unique<DomainIntegral<Dim>>(constant_field<Dim>(1), DomainIntegralOptions{}));
  EXPECT_EQ(sum.name(), "boundary-integral + domain-integral");
}

}  // namespace
}  // namespace surf::energy
