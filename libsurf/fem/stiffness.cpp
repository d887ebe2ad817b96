#include "libsurf/fem/stiffness.h"

#include "libsurf/fem/detail/assemble.h"
#include "libsurf/fem/p1.h"

namespace surf::fem {

template <int Dim>
SparseMatrix stiffness(const Geometry<Dim>& shape, const Eigen::VectorXd& alpha) {
  return assemble<Dim>(shape, [&](Eigen::Index t) {
    return p1_stiffness<Dim, Dim>(shape.basis_gradients(t), alpha[t] * shape.measures()[t]);
  });
}

template <int Dim>
SparseMatrix stiffness(const Geometry<Dim>& shape) {
  Eigen::VectorXd alpha = Eigen::VectorXd::Ones(shape.n_elements());
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    if (shape.place(t) == Place::kBorder) alpha[t] = 0;
  return stiffness<Dim>(shape, alpha);
}

template <int Dim>
// NOLINTNEXTLINE(performance-unnecessary-value-param): A is written through its iterators
SparseMatrix normal_stiffness(const Geometry<Dim>& shape, SparseMatrix A) {
  const Points<Dim>& normals = shape.directions();
  for (Eigen::Index i = 0; i < A.outerSize(); ++i)
    for (SparseMatrix::InnerIterator entry(A, i); entry; ++entry)
      entry.valueRef() *= normals.row(i).dot(normals.row(entry.col()));
  return A;
}

template <int Dim>
Eigen::VectorXd mean_curvature(const Geometry<Dim>& shape, const SparseMatrix& A) {
  const Points<Dim> weak = A * shape.points();
  return shape.nodal_normals().cwiseProduct(weak).rowwise().sum().cwiseQuotient(
      shape.lumped_mass());
}

template SparseMatrix stiffness<2>(const Geometry<2>&, const Eigen::VectorXd&);
template SparseMatrix stiffness<3>(const Geometry<3>&, const Eigen::VectorXd&);
template SparseMatrix stiffness<2>(const Geometry<2>&);
template SparseMatrix stiffness<3>(const Geometry<3>&);
template SparseMatrix normal_stiffness<2>(const Geometry<2>&, SparseMatrix);
template SparseMatrix normal_stiffness<3>(const Geometry<3>&, SparseMatrix);
template Eigen::VectorXd mean_curvature<2>(const Geometry<2>&, const SparseMatrix&);
template Eigen::VectorXd mean_curvature<3>(const Geometry<3>&, const SparseMatrix&);

}  // namespace surf::fem
