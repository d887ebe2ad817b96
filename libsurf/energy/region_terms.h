// Derivative and scalar product of region terms; private to energy/*.cpp.
#pragma once

#include <array>

#include "libsurf/base/field.h"
#include "libsurf/energy/shape_energy.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {

/// Adds the terms of dJ = int_Gamma F(I) V dS with F and dF/dI from `density(I)`:
/// derivative <F nu, phi_i>, beta = F'(I) d_nu I + kappa F.
template <int Dim, class Density>
void add_region_terms(const Field<Dim>& field, const fem::Geometry<Dim>& shape,
                      int quadrature_order, const Eigen::VectorXd& curvature, double weight,
                      const Density& density, ShapeTerms<Dim>& terms) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  const Elements<Dim>& T = shape.elements();
  Samples<Dim> samples;
  field.sample(fem::quadrature_points<Dim>(shape.points(), T, rule.points), Derivatives::kFirst,
               samples);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const Vector<Dim> nu = shape.normals().row(t);
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const auto [F, dF] = density(samples.value[at]);
      double kappa = 0;
      for (int i = 0; i < Dim; ++i) kappa += rule.points(q, i) * curvature[T(t, i)];
      const double beta = dF * samples.gradient.row(at).dot(nu) + kappa * F;
      for (int i = 0; i < Dim; ++i) {
        const double w = weight * rule.weights[q] * shape.measures()[t] * rule.points(q, i);
        terms.derivative.row(T(t, i)) += w * F * nu;
        terms.beta[T(t, i)] += w * beta / shape.lumped_mass()[T(t, i)];
      }
    }
  }
}

}  // namespace surf::energy
