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

/// Adds weight * element_matrix(t), (Dim, Dim), of every element to a matrix with the pattern of
/// the shape's topology.
template <int Dim, class ElementMatrix>
void add_element_matrices(const fem::Geometry<Dim>& shape, double weight, SparseMatrix& matrix,
                          const ElementMatrix& element_matrix) {
  double* values = matrix.valuePtr();
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const Eigen::Matrix<double, Dim, Dim> local = element_matrix(t);
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) values[shape.topology().slot(t, i, j)] += weight * local(i, j);
  }
}

}  // namespace surf::energy
