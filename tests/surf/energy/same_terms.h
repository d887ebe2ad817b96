// Two energies that have to be the same.
#pragma once

#include "libsurf/energy/shape_energy.h"
#include "tests/surf/fixtures.h"

namespace surf::test {

struct TermTolerances {
  double value, first, beta;  ///< first: of the derivative, of g and of alpha
};

/// Resets both to the shape; their values, first derivatives and weights have to agree.
template <int Dim>
void expect_same_terms(energy::ShapeEnergy<Dim>& a, energy::ShapeEnergy<Dim>& b,
                       const fem::Geometry<Dim>& shape, const fem::Curvature& kappa,
                       const TermTolerances& tolerances) {
  a.reset(shape), b.reset(shape);
  EXPECT_NEAR(a.value(), b.value(), tolerances.value);
  constexpr double kWeight = 2;
  energy::ShapeTerms<Dim> of_a(shape), of_b(shape);
  a.differentiate(kappa, kWeight, of_a), b.differentiate(kappa, kWeight, of_b);
  EXPECT_LT((of_a.derivative - of_b.derivative).cwiseAbs().maxCoeff(), tolerances.first);
  EXPECT_LT((of_a.g - of_b.g).cwiseAbs().maxCoeff(), tolerances.first);
  EXPECT_LT((of_a.alpha - of_b.alpha).cwiseAbs().maxCoeff(), tolerances.first);
  EXPECT_LT((of_a.beta - of_b.beta).cwiseAbs().maxCoeff(), tolerances.beta);
}

}  // namespace surf::test
