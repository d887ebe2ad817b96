// Assembly of a sparse matrix from element matrices; private to fem/*.cpp.
#pragma once

#include "libsurf/fem/geometry.h"

namespace surf::fem {

/// Sum over the elements of element_matrix(t), a (Dim, Dim) matrix, in element order: the
/// same bits for any number of threads. The sparsity is that of the shape's topology.
template <int Dim, class ElementMatrix>
SparseMatrix assemble(const Geometry<Dim>& shape, const ElementMatrix& element_matrix) {
  SparseMatrix result = shape.topology().pattern();
  double* values = result.valuePtr();
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const Eigen::Matrix<double, Dim, Dim> local = element_matrix(t);
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) values[shape.topology().slot(t, i, j)] += local(i, j);
  }
  return result;
}

}  // namespace surf::fem
