// Sums over elements that second derivatives are made of; private to energy/*.cpp.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::energy {

/// A nodal function at the point of element t with barycentric coordinates phi.
template <int Dim>
double at_point(const Eigen::VectorXd& nodal, const fem::Geometry<Dim>& shape, Eigen::Index t,
                const Vector<Dim>& phi) {
  double sum = 0;
  for (int i = 0; i < Dim; ++i) sum += phi[i] * nodal[shape.elements()(t, i)];
  return sum;
}

/// The length or area as boundary energies charge it.
template <int Dim>
double charged_measure(const fem::Geometry<Dim>& shape) {
  return shape.charged_measures().sum();
}

/// Adds weight times its derivative, and what goes with it.
template <int Dim, class Terms>
void add_measure_terms(const fem::Geometry<Dim>& shape, double weight, Terms& terms) {
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    if (shape.place(t) == fem::Place::kBorder) continue;
    terms.alpha[t] += weight;
    for (int i = 0; i < Dim; ++i) {
      const int at = shape.elements()(t, i);
      terms.g[at] += weight * shape.measures()[t] / (Dim * shape.lumped_mass()[at]);
      if (shape.place(t) == fem::Place::kFree)
        terms.derivative.row(at) += weight * shape.measures()[t] * shape.basis_gradients(t).row(i);
    }
  }
}

/// Adds weight * element_matrix(t), (Dim, Dim), of every element that does not lie on the border to
/// a matrix with the pattern of the shape's topology.
template <int Dim, class ElementMatrix>
void add_element_matrices(const fem::Geometry<Dim>& shape, double weight, SparseMatrix& matrix,
                          const ElementMatrix& element_matrix) {
  double* values = matrix.valuePtr();
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    if (shape.place(t) == fem::Place::kBorder) continue;
    const Eigen::Matrix<double, Dim, Dim> local = element_matrix(t);
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) values[shape.topology().slot(t, i, j)] += weight * local(i, j);
  }
}

}  // namespace surf::energy
