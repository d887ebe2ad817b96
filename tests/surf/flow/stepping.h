// Velocity systems stepped by hand, with a fixed time step.
#pragma once

#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/energy/fields.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/velocity.h"
#include "tests/surf/fixtures.h"

namespace surf::test {

/// Everything that a velocity is made from at one shape.
template <int Dim>
struct Direction {
  SparseMatrix A;
  energy::ShapeTerms<Dim> terms;
  flow::VelocitySystem<Dim> system;

  Direction(const fem::Geometry<Dim>& shape, energy::ShapeEnergy<Dim>& J,
            const flow::VelocityOptions& options)
      : A(fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()))),
        terms(terms_of(shape, A, J)),
        system(shape, terms, A, options) {}

  static energy::ShapeTerms<Dim> terms_of(const fem::Geometry<Dim>& shape, const SparseMatrix& A,
                                          energy::ShapeEnergy<Dim>& J) {
    J.reset(shape);
    energy::ShapeTerms<Dim> terms(shape);
    J.differentiate(fem::curvature<Dim>(shape, A), 1, terms);
    return terms;
  }
};

template <int Dim>
fem::Geometry<Dim> stepped(const fem::Geometry<Dim>& shape, const flow::Velocity<Dim>& velocity,
                           double tau) {
  return shape.moved_to(shape.points() + tau * velocity.vector);
}

/// n steps of length tau.
template <int Dim>
fem::Geometry<Dim> flowed(fem::Geometry<Dim> shape, energy::ShapeEnergy<Dim>& J,
                          const flow::VelocityOptions& options, double tau, int n) {
  for (int k = 0; k < n; ++k) {
    const Direction<Dim> direction(shape, J, options);
    shape = stepped<Dim>(shape, direction.system.solve(tau), tau);
  }
  return shape;
}

/// J = |Gamma|.
template <int Dim>
energy::BoundaryIntegral<Dim> area_energy() {
  return energy::BoundaryIntegral<Dim>(energy::constant_field<Dim>(1));
}

}  // namespace surf::test
