// Derivatives of region terms dJ = int_Gamma F(I) V dS; private to energy/*.cpp.
#pragma once

#include <array>

#include "libsurf/base/field.h"
#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/energy/domain_integrals.h"
#include "libsurf/energy/shape_energy.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {

/// Adds the terms of dJ = int_Gamma F(I) V dS with F and dF/dI from `density(I)`:
/// derivative <F nu, phi_i>, beta = F'(I) d_nu I + kappa F.
/// @param curvature  mean
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
      const double kappa = at_point<Dim>(curvature, shape, t, rule.points.row(q));
      const double beta = dF * samples.gradient.row(at).dot(nu) + kappa * F;
      for (int i = 0; i < Dim; ++i) {
        const double w = weight * rule.weights[q] * shape.measures()[t] * rule.points(q, i);
        terms.derivative.row(T(t, i)) += w * F * nu;
        if (shape.place(t) != fem::Place::kBorder)
          terms.beta[T(t, i)] += w * beta / shape.lumped_mass()[T(t, i)];
      }
    }
  }
}

/// Adds weight * int_Gamma (F'(I) d_nu I + kappa F) V W dS, the second derivative at a frozen F.
template <int Dim, class Density>
void add_region_second(const Field<Dim>& field, const fem::Geometry<Dim>& shape,
                       int quadrature_order, const Eigen::VectorXd& curvature, double weight,
                       const Density& density, SparseMatrix& second) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  Samples<Dim> samples;
  field.sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points),
               Derivatives::kFirst, samples);
  add_element_matrices<Dim>(shape, weight, second, [&](Eigen::Index t) {
    const Vector<Dim> nu = shape.normals().row(t);
    Eigen::Matrix<double, Dim, Dim> local = Eigen::Matrix<double, Dim, Dim>::Zero();
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const Vector<Dim> phi = rule.points.row(q);
      const auto [F, dF] = density(samples.value[at]);
      const double beta =
          dF * samples.gradient.row(at).dot(nu) + at_point<Dim>(curvature, shape, t, phi) * F;
      local += rule.weights[q] * beta * phi * phi.transpose();
    }
    return Eigen::Matrix<double, Dim, Dim>(shape.measures()[t] * local);
  });
}

/// <w_k(I), phi_i n_i . nu>, the derivatives of int_Omega w_k(I) dx for normal velocities, (n, k).
template <int Dim>
Eigen::MatrixXd region_loads(const Field<Dim>& field, const fem::Geometry<Dim>& shape,
                             int quadrature_order, const Integrands& integrands, int n_integrands) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  const Elements<Dim>& T = shape.elements();
  Samples<Dim> samples;
  field.sample(fem::quadrature_points<Dim>(shape.points(), T, rule.points), Derivatives::kNone,
               samples);
  Eigen::MatrixXd values(samples.value.size(), n_integrands);
  integrands(samples.value, values);
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(shape.n_vertices(), n_integrands);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    for (Eigen::Index q = 0; q < rule.size(); ++q)
      for (int i = 0; i < Dim; ++i) {
        const double normal = shape.directions().row(T(t, i)).dot(shape.normals().row(t));
        loads.row(T(t, i)) += rule.weights[q] * shape.measures()[t] * rule.points(q, i) * normal *
                              values.row(t * rule.size() + q);
      }
  return loads;
}

}  // namespace surf::energy
