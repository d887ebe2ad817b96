#include "libsurf/energy/domain_integral.h"

#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(DomainTerm);

TYPED_TEST(DomainTerm, OfOneIsTheEnclosedContentWithTheNormalsAsDerivative) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  DomainIntegral<Dim> J(constant_field<Dim>(1), {});
  J.reset(shape);
  EXPECT_NEAR(J.value(), shape.enclosed(), 1e-13);
  ShapeTerms<Dim> terms(shape);
  J.differentiate(test::no_curvature(shape.n_vertices()), 2, terms);
  const Points<Dim> expected = 2.0 * (shape.lumped_mass().asDiagonal() * shape.nodal_normals());
  EXPECT_LT((terms.derivative - expected).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(terms.g.norm(), 0);
  EXPECT_EQ(terms.alpha.norm(), 0);
}

TYPED_TEST(DomainTerm, RemembersATrialOnlyIfItIsAccepted) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(2);
  DomainIntegral<Dim> J(std::make_shared<const test::WaveField<Dim>>(1), {});
  J.reset(shape);
  const double before = J.value();
  const double tried = J.try_move(shape.moved_to(1.1 * shape.points()));
  EXPECT_NE(tried, before);
  EXPECT_EQ(J.value(), before);
  EXPECT_EQ(J.try_move(shape.moved_to(1.1 * shape.points())), tried);
  J.accept();
  EXPECT_EQ(J.value(), tried);
  EXPECT_EQ(J.try_move(shape.moved_to(1.1 * shape.points())), tried);  // no way to go
}

TYPED_TEST(DomainTerm, KeepsItsValueWhenTheMeshChanges) {
  constexpr int Dim = TypeParam::value;
  const auto coarse = test::unit_sphere<Dim>(2), fine = test::unit_sphere<Dim>(3);
  DomainIntegral<Dim> J(std::make_shared<const test::WaveField<Dim>>(1), {});
  J.reset({coarse.X, coarse.T});
  const double before = J.value();
  const fem::Geometry<Dim> shape(fine.X, fine.T);
  J.remesh(shape);
  EXPECT_EQ(J.value(), before);
  EXPECT_EQ(J.try_move(shape), before);
}

}  // namespace
}  // namespace surf::energy
